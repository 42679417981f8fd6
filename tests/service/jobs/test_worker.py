"""The process of one job, spoken to as the service does: JSON in, lines of JSON out, within its limits."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import motionenv

ROOT = Path(__file__).parents[3]
LIMITS = {"memory": 3_000_000_000, "cpu": 60.0, "parent": os.getpid()}
CONVERT = {"fps": None, "unit": None, "format": "application/x-npz", "suffix": ".npz"}


def run(folder: Path, kind: str, settings: dict, **limits) -> tuple[int, list[dict], str]:
    """Exit status, messages and what was said besides, of a job that works in `folder`."""
    work = json.dumps({"kind": kind, "settings": settings, "limits": LIMITS | limits})
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-P", "-m", "service.jobs.worker"]
    done = subprocess.run(command, cwd=folder, env=environment, input=work, capture_output=True, text=True)
    return done.returncode, [json.loads(line) for line in done.stdout.splitlines()], done.stderr


@pytest.fixture
def folder(tmp_path) -> Path:
    (tmp_path / "input").mkdir()
    motionenv.write(motionenv.synthesize("walk/fpca", 1, 60, seed=1), tmp_path / "input" / "walk.bvh")
    return tmp_path


def test_progress_is_told_and_then_the_end(folder):
    status, messages, _ = run(folder, "convert", CONVERT)
    assert status == 0
    *steps, end = messages
    assert end == {"done": True}
    assert steps[0] == {"progress": 0.0, "message": "reading walk.bvh"}
    assert [step["progress"] for step in steps] == sorted(step["progress"] for step in steps)
    with np.load(folder / "result") as result:
        assert result["poses"].shape == (60, 25)


def test_what_can_not_be_read_is_told_without_paths_of_this_machine(folder):
    (folder / "input" / "walk.bvh").write_text("HIERARCHY\nnonsense")
    status, messages, _ = run(folder, "convert", CONVERT)
    assert status == 0
    assert messages[-1]["failed"] == 422
    assert messages[-1]["detail"].startswith("walk.bvh")
    assert str(folder) not in json.dumps(messages)
    assert "input" not in messages[-1]["detail"]
    assert not (folder / "result").exists()


def test_a_process_of_another_parent_does_nothing(folder):
    status, messages, _ = run(folder, "convert", CONVERT, parent=1)
    assert (status, messages) == (1, [])
    assert not (folder / "result").exists()


LIMITED = """
import os, resource
from service.jobs.worker import limit
limit(3_000_000_000, 7.0, os.getppid())
for name in ("AS", "CPU", "CORE", "FSIZE", "NOFILE"):
    print(name, *resource.getrlimit(getattr(resource, f"RLIMIT_{name}")))
print("NICE", os.nice(0), 0)
try:
    bytearray(4_000_000_000)
except MemoryError:
    print("MEMORY", 1, 1)
"""


def test_limits_are_those_of_the_system(tmp_path):
    done = subprocess.run([sys.executable, "-c", LIMITED], cwd=ROOT, capture_output=True, text=True, check=True)
    told = {name: (int(soft), int(hard)) for name, soft, hard in map(str.split, done.stdout.splitlines())}
    assert told["AS"] == (3_000_000_000, 3_000_000_000)
    assert told["CPU"] == (8, 13)
    assert told["CORE"] == (0, 0)
    assert told["NOFILE"] == (256, 256)
    assert told["FSIZE"] == (2 << 30, 2 << 30)
    assert told["NICE"][0] >= 10
    assert "MEMORY" in told
