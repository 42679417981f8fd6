"""The command as a program of its own, and what it says when it refuses."""

import os
import subprocess
import sys
from pathlib import Path

import motionenv

PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(motionenv.__file__).parents[1])}


def in_a_process(*args, **options) -> subprocess.CompletedProcess:
    """`python -m motionenv ARGS` as a program of its own, with the package that these tests import."""
    command = [sys.executable, "-m", "motionenv", *map(str, args)]
    return subprocess.run(command, text=True, timeout=120, check=False, env=ENVIRONMENT, **PIPES | options)


def refused(result, says: str) -> None:
    """Exit code 2 and one line on stderr that holds `says`."""
    assert result.code == 2
    assert result.err.startswith("motionenv: ")
    assert result.err.count("\n") == 1
    assert says in result.err
