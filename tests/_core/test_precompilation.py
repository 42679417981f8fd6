"""Kernels that a task needs: the record of them is complete, and other processes compile them."""

import inspect
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from typing import NamedTuple

import numpy as np
import pytest
from numba import float64, typeof

from benchmarks.recording import encoded
from benchmarks.startup import TASKS, prepare
from motionenv._core import compilation, precompilation
from motionenv._core.compilation import kernel
from motionenv.cli.bench import compile_kernels

HELPER = [sys.executable, "-m", "motionenv._core.precompilation"]
#: Holds the lock of `doubled` until its input ends.
HOLDS = f"""
import sys
from motionenv._core.compilation import cache_folder
from motionenv._core.locks import lock
(cache_folder() / "locks").mkdir(parents=True)
file = open(cache_folder() / "locks" / "{__name__}.doubled.lock", "w")
lock(file)
print("held", flush=True)
sys.stdin.read()
"""


class Pair(NamedTuple):
    """A tuple with names."""

    first: float
    second: np.ndarray


@kernel
def doubled(x):
    return 2 * x


@kernel
def halved(x):
    return x / 2


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    """A cache of this test's own."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    return tmp_path / "kernels"


@pytest.fixture
def started(monkeypatch):
    """The tasks of helpers that would be started, instead of starting any."""
    found: list = []
    monkeypatch.setattr(precompilation, "_helper", lambda tasks: found.append(tasks))
    monkeypatch.setattr(precompilation, "cores", lambda: 2)
    monkeypatch.setattr(compilation, "helpers", [])
    monkeypatch.setattr(compilation, "waiting", [])
    monkeypatch.setattr(compilation.logger, "warning", lambda *_: None)
    monkeypatch.setattr(precompilation.Recorded, "is_compiled", lambda each: False)  # some are, in this process
    precompilation.precompile.cache_clear()
    yield found
    precompilation.precompile.cache_clear()


@pytest.mark.parametrize("each", precompilation.recorded(TASKS), ids=lambda each: each.kernel)
def test_each_recorded_kernel_exists(each):
    found, types = each.load()
    assert isinstance(found, compilation._Kernel)
    assert len(types) == len(inspect.signature(found.py_func).parameters)
    assert [encoded(one) for one in types] == each.types


def test_every_task_is_recorded():
    *rest, last = sorted(TASKS)
    assert precompilation.recorded_tasks() == [*rest, last]
    assert f"{', '.join(rest)} or {last};" in inspect.getsource(compile_kernels)


@pytest.mark.slow
def test_the_record_is_complete(tmp_path):
    """After `motionenv compile`, no task compiles anything."""
    prepare(tmp_path)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    subprocess.run([sys.executable, "-m", "motionenv", "compile"], env=environment, check=True)
    before = sorted((tmp_path / "kernels").rglob("*.nb?"))
    assert before
    for task, script in TASKS.items():
        done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True)
        assert done.returncode == 0, (task, done.stderr)
        assert b"compiling" not in done.stderr, task
        assert sorted((tmp_path / "kernels").rglob("*.nb?")) == before, task


@pytest.mark.parametrize(
    "value",
    [1.5, 2, True, np.float32(1), np.zeros((2, 3)), np.zeros(2, np.uint8), np.ones((2, 3), order="F"), np.ones(4)[::2],
     np.zeros(2, [("a", "i4"), ("b", "f4")]),
     np.frombuffer(b"12345678"), (1, 2.0), (1.0, 2.0), (np.zeros(2), (1, 2.0)), Pair(1.0, np.zeros(3)), Pair(1.0, 2.0)],
    ids=repr,
)  # fmt: skip
def test_types_survive_encoding(value):
    assert precompilation.decoded(encoded(typeof(value))) == typeof(value)


def test_helpers_are_started_for_what_is_not_compiled(started):
    precompilation.precompile("render")
    assert started == [["render"]]
    assert len(compilation.waiting) == len(precompilation.recorded(["render"]))


@pytest.mark.parametrize(
    ("module", "name", "value"),
    [
        (multiprocessing, "parent_process", lambda: "a process"),
        (precompilation, "cores", lambda: 1),
        (precompilation.Recorded, "is_compiled", lambda each: True),
        (sys, "executable", ""),
        (compilation.config, "DISABLE_JIT", 1),
    ],
    ids=["multiprocessing", "one core", "warm", "embedded", "without compilation"],
)
def test_no_helper_is_started(started, monkeypatch, module, name, value):
    monkeypatch.setattr(module, name, value)
    precompilation.precompile("render")
    assert started == []


def test_no_helper_is_started_where_kernels_can_not_be_kept(started, monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "kernels"))
    precompilation.precompile("render")
    assert started == []


def test_who_waits_for_a_kernel_compiles_others(monkeypatch):
    monkeypatch.setattr(compilation, "waiting", [(halved, (float64,))])
    with subprocess.Popen([sys.executable, "-c", HOLDS], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"held\n"

        def release() -> None:
            while (float64,) not in halved.overloads:
                time.sleep(0.01)
            other.stdin.close()

        thread = threading.Thread(target=release)
        thread.start()
        assert doubled(3) == 6
        thread.join()
    assert compilation.waiting == []


def test_a_helper_that_fails_is_told_of_and_the_kernel_is_compiled_here(monkeypatch, caplog):
    failed = subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"])
    failed.wait()
    monkeypatch.setattr(compilation, "helpers", [failed])
    assert doubled(1.5) == 3.0
    assert "exit code 3: doubled is compiled here" in caplog.text


def test_a_helper_ends_with_its_parent(empty_cache):
    with subprocess.Popen([*HELPER, "demo"], stdin=subprocess.PIPE) as helper:
        deadline = time.monotonic() + 60
        while not list(empty_cache.glob("locks/*")):  # until it has begun
            assert time.monotonic() < deadline
            time.sleep(0.05)
        helper.stdin.close()
        assert helper.wait(20) == 0
    assert not list(empty_cache.rglob("*_draw_kernel*/draw*.nbc"))
