"""The cache of compiled kernels: never stale, in the user's folder, bounded; and what is said while kernels compile."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from motionenv._core import compilation

CALLER = """from small.constants import FACTOR
from small.callee import inner
from motionenv._core.compilation import kernel


@kernel
def outer(x):
    return FACTOR * inner(x)
"""
CALLEE = """from motionenv._core.compilation import kernel, part


@{}
def inner(x):
    return x + {}
"""
ASKS = """
import sys
from small.caller import outer
print(outer(1.0), len(outer.stats.cache_hits))
"""
ASKS_TWICE = ASKS + "assert outer(1) == 20.0"  # for an integer it is compiled again


@pytest.fixture(params=["kernel", "part"])
def callee(request) -> str:
    """The text of a file with a kernel or a part that adds `{}`."""
    return CALLEE.format(request.param, "{}")


@pytest.fixture
def package(tmp_path, callee) -> Path:
    """A package of a kernel, of another or a part that it calls, in another file, and a constant in a third."""
    folder = tmp_path / "code" / "small"
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text("")
    (folder / "caller.py").write_text(CALLER)
    (folder / "callee.py").write_text(callee.format("1.0"))
    (folder / "constants.py").write_text("FACTOR = 10.0\n")
    return folder


def ask(package: Path, cache: Path, script: str = ASKS) -> tuple[float, int, str]:
    """What `outer(1.0)` is in a fresh process, how often it came from the cache, and what was logged."""
    paths = [str(package.parent), str(Path(compilation.__file__).parents[2])]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run([sys.executable, "-B", "-c", script], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    value, hits = done.stdout.split()
    return float(value), int(hits), done.stderr


def rewritten(file: Path, text: str) -> None:
    """Another text of the same length and time stamp: numba's own cache, which looks at these two, would miss it."""
    before = file.stat()
    assert len(text) == before.st_size
    file.write_text(text)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def test_a_kernel_is_compiled_once(package, tmp_path):
    assert ask(package, tmp_path / "cache")[:2] == (20.0, 0)
    assert ask(package, tmp_path / "cache")[:2] == (20.0, 1)


def test_processes_that_start_together_compile_once(package, tmp_path):
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: ask(package, tmp_path / "cache"), range(4)))
    assert [value for value, _, _ in found] == [20.0] * 4
    assert sum("compiling kernels" in said for _, _, said in found) == 1
    assert sorted(hits for _, hits, _ in found) == [0, 1, 1, 1]


def test_a_changed_callee_in_another_file_is_seen(package, callee, tmp_path):
    ask(package, tmp_path / "cache")
    rewritten(package / "callee.py", callee.format("2.0"))
    assert ask(package, tmp_path / "cache")[:2] == (30.0, 0)


def test_a_changed_constant_in_another_file_is_seen(package, tmp_path):
    ask(package, tmp_path / "cache")
    rewritten(package / "constants.py", "FACTOR = 20.0\n")
    assert ask(package, tmp_path / "cache")[:2] == (40.0, 0)


def test_a_change_is_undone_without_compiling_again(package, callee, tmp_path):
    ask(package, tmp_path / "cache")
    rewritten(package / "callee.py", callee.format("2.0"))
    ask(package, tmp_path / "cache")
    rewritten(package / "callee.py", callee.format("1.0"))
    assert ask(package, tmp_path / "cache")[:2] == (20.0, 1)


def test_compilation_is_said_once_with_the_kernel_s_name(package, tmp_path):
    first, second = ask(package, tmp_path / "cache")[2], ask(package, tmp_path / "cache")[2]
    assert "compiling kernels, once for this version and machine: outer, 0 s" in first
    assert second == ""


def test_each_processor_gets_kernels_of_its_own(package, tmp_path, monkeypatch):
    for name in ("generic", "haswell"):
        monkeypatch.setenv("NUMBA_CPU_NAME", name)
        assert [ask(package, tmp_path / "cache")[:2] for _ in range(2)] == [(20.0, 0), (20.0, 1)]


def test_nothing_is_written_beside_the_code(package, tmp_path):
    before = sorted(package.iterdir())
    ask(package, tmp_path / "cache")
    assert sorted(package.iterdir()) == before


def test_a_cache_that_can_not_be_written_is_said_and_the_kernel_works(package, tmp_path):
    (tmp_path / "file").write_text("a file where a folder should be")
    value, hits, said = ask(package, tmp_path / "file" / "cache", ASKS_TWICE)
    assert (value, hits) == (20.0, 0)
    assert said.count("NUMBA_CACHE_DIR") == 1


def test_without_optimisation_kernels_work_and_are_not_kept(package, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_OPT", "0")
    value, hits, said = ask(package, tmp_path / "cache")
    assert (value, hits) == (20.0, 0)
    assert "Cannot cache compiled function" in said


def test_the_oldest_kernels_go_when_there_are_too_many(tmp_path, monkeypatch):
    monkeypatch.setattr(compilation, "LIMIT", 250)
    for age, name in enumerate(("newest", "older", "oldest")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "kernel.nbi").write_bytes(bytes(100))
        os.utime(folder, (1e9 - age, 1e9 - age))
    (tmp_path / "somebody else's").mkdir()
    compilation.prune(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["newest", "older", "somebody else's"]


def test_every_kernel_of_the_library_is_in_this_cache():
    """A decorator of numba's own with `cache=True` would bring stale kernels back."""
    root = Path(compilation.__file__).parents[1]
    mine = Path(compilation.__file__)
    assert not [
        path for path in root.rglob("*.py") if path != mine and "cache=True" in path.read_text(encoding="utf-8")
    ]


def test_folders_are_the_users_own(monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert compilation.cache_folder() == Path("/somewhere/motionenv/kernels")
