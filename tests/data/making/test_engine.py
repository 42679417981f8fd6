"""Work spread over processes."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from functools import partial
from pathlib import Path

import pytest

from motionenv.data.making.engine import run
from motionenv.errors import MotionError


def square(task: int) -> int:
    return task * task


def fails(folder: str, task: int) -> int:
    """Fails for odd tasks, always; and at the first attempt for multiples of four."""
    first = Path(folder) / f"tried-{task}"
    if task % 2 or (task % 4 == 0 and not first.exists()):
        first.touch()
        raise RuntimeError(f"not {task}")
    return task


def dies(folder: str, task: int) -> int:
    """Kills its process in task 2, the first time."""
    if task == 2 and not (Path(folder) / "died").exists():
        (Path(folder) / "died").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return task


@pytest.mark.parametrize("workers", [1, 2])
def test_all_is_done_once_told(workers):
    told = []
    outcome = run(square, range(9), workers=workers, on_done=told.append)
    assert outcome.done == {k: k * k for k in range(9)}
    assert sorted(told) == sorted(outcome.done.values())
    assert not outcome.failed


@pytest.mark.parametrize("workers", [1, 2])
def test_failures_are_tried_again_then_told_and_stop_nobody(workers, tmp_path):
    outcome = run(partial(fails, str(tmp_path)), range(8), workers=workers)
    assert set(outcome.done) == {0, 2, 4, 6}
    assert outcome.failed == {k: f"RuntimeError: not {k}" for k in (1, 3, 5, 7)}


def test_a_worker_that_is_killed_is_replaced(tmp_path):
    outcome = run(partial(dies, str(tmp_path)), range(12), workers=2)
    assert outcome.done == {k: k for k in range(12)}


def test_workers_are_counted():
    with pytest.raises(MotionError, match="workers must be a whole number at least 1, got 0|from 1, got 0"):
        run(square, [1], workers=0)


INTERRUPTED = """
import sys, time
from pathlib import Path
from motionenv.data.making.engine import run

def slow(task):
    Path(sys.argv[1], f"begun-{task}").touch()
    time.sleep(0.2 if task < 2 else 60)
    return task

if __name__ == "__main__":
    told = lambda task: Path(sys.argv[1], f"told-{task}").touch()
    outcome = run(slow, range(8), workers=int(sys.argv[2]), on_done=told)
    print(sorted(outcome.done), outcome.interrupted, len(outcome.failed))
"""


def gone(group: int) -> bool:
    """Whether all processes of a group end within a minute; Python's own tracker of resources takes a moment."""
    for _ in range(600):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_ends_the_work_and_leaves_no_process(workers, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(textwrap.dedent(INTERRUPTED))
    started = subprocess.Popen(
        [sys.executable, script, tmp_path, workers], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    while not all((tmp_path / name).exists() for name in ("told-0", "told-1", "begun-2")):
        assert started.poll() is None
        time.sleep(0.05)
    os.killpg(started.pid, signal.SIGINT)  # the terminal sends it to all of them
    said, _ = started.communicate(timeout=60)
    assert said.strip() == "[0, 1] True 0"
    assert gone(started.pid)
