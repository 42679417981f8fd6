"""Locks between processes."""

import subprocess
import sys

import pytest

from motionenv._core import locks

HOLDS = """
import sys
from motionenv._core.locks import lock
file = open(sys.argv[1], "w")
print(lock(file), flush=True)
sys.stdin.read()
"""


def test_one_process_has_a_lock_until_it_ends(tmp_path):
    path = tmp_path / "lock"
    with subprocess.Popen([sys.executable, "-c", HOLDS, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"True\n"
        with open(path, "w") as file:
            assert not locks.lock(file, wait=False)
            other.kill()
            assert locks.lock(file)


def test_a_system_without_locks_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "fcntl", None)
    with open(tmp_path / "lock", "w") as file, pytest.raises(OSError, match="no file locks"):
        locks.lock(file)
