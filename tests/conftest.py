"""What the tests share: real motion capture, whether OpenGL works here, running commands, and services that run."""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import settings

from tests.service.running import Server, run_service

# The same examples in every run, and no deadline: the first call of a kernel compiles it.
settings.register_profile("motionenv", deadline=None, derandomize=True, database=None)
settings.load_profile("motionenv")

MOCAP = Path(os.environ.get("MOTIONENV_MOCAP", Path(__file__).parents[2] / "shared" / "mocap"))


def pytest_configure(config) -> None:
    """Models that are made on first use go to a folder of this run, not to the user's cache."""
    if "PYTEST_XDIST_WORKER" not in os.environ:  # workers share what the run's first process sets here
        folder = tempfile.TemporaryDirectory(prefix="motionenv-cache-")
        config.add_cleanup(folder.cleanup)
        os.environ["MOTIONENV_CACHE"] = folder.name
        # Before workers load NumPy: with threads of BLAS in each, small matrices take twice as long.
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ.setdefault(name, "1")


@pytest.fixture(scope="session")
def mocap() -> Path:
    """Folder of real motion capture: beside the checkout in ../shared/mocap, or where MOTIONENV_MOCAP says."""
    if not MOCAP.is_dir():
        pytest.skip(f"no motion capture at {MOCAP}: set MOTIONENV_MOCAP to its folder")
    return MOCAP


@pytest.fixture(scope="session")
def cmu_walkers(mocap) -> list[tuple]:
    """Markers, Fourier walker and person of each straight CMU walk."""
    from benchmarks.captured_walks import cmu_markers
    from motionenv.models.eigenwalkers import fourier_walker

    return [(m, fourier_walker(m), person) for m, person in zip(*cmu_markers(mocap), strict=True)]


@pytest.fixture(scope="session")
def opengl() -> None:
    """For tests that draw with pyrender: skips where it can't, and says why; fails there when CI promised that it can.

    A session that uses it must not fork afterwards: OpenGL hangs in forked children.
    """
    import numpy as np

    from motionenv.body import from_height
    from motionenv.errors import EngineError
    from motionenv.render import render
    from motionenv.render.cameras import look_at

    try:
        render(np.zeros(25), from_height(), look_at((4, 0, 1), (0, 0, 1), width=16, height=16), engine="pyrender")
    except EngineError as error:
        if os.environ.get("MOTIONENV_REQUIRE_PYRENDER"):
            pytest.fail(f"MOTIONENV_REQUIRE_PYRENDER is set, but: {error}")
        pytest.skip(str(error))


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Runs `motionenv ARGS` in an empty folder, in this process; gives exit code, stdout and stderr."""
    from motionenv import cli

    monkeypatch.chdir(tmp_path)

    def command(*args) -> SimpleNamespace:
        monkeypatch.setattr(sys, "argv", ["motionenv", *map(str, args)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        return SimpleNamespace(code=ended.value.code or 0, out=out, err=err)

    return command


@pytest.fixture(scope="session")
def serving() -> Callable[..., AbstractContextManager[Server]]:
    """`with serving(folder, **settings) as server:` runs a service with settings of its own."""
    return run_service


@pytest.fixture(scope="session")
def server(tmp_path_factory) -> Iterator[Server]:
    """A service that asks for no key."""
    with run_service(tmp_path_factory.mktemp("service")) as running:
        yield running


@pytest.fixture(scope="session")
def locked(tmp_path_factory) -> Iterator[Server]:
    """A service that asks for a key, takes JSON of 2,000 bytes at most, and lets a lab's pages ask."""
    settings = {"keys": ["a-key-that-only-tests-know"], "max_json": 2000, "cors": ["https://lab.example"]}
    with run_service(tmp_path_factory.mktemp("locked"), **settings) as running:
        yield running


@pytest.fixture(scope="session")
def blazepose() -> Path:
    """A wheel with BlazePose's models, which are also where they would be downloaded to.

    Skips where LiteRT or the wheel can't be had, unless CI promised them.
    """
    from subprocess import CalledProcessError

    from tests.blazepose import placed, wheel

    try:
        import ai_edge_litert  # noqa: F401

        placed(Path(os.environ["MOTIONENV_CACHE"]) / "blazepose")
        return wheel()
    except (ImportError, CalledProcessError) as error:
        if os.environ.get("MOTIONENV_REQUIRE_BLAZEPOSE"):
            pytest.fail(f"MOTIONENV_REQUIRE_BLAZEPOSE is set, but: {error}")
        pytest.skip(f"no BlazePose: {error}")
