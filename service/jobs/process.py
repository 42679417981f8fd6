"""`python -m service.jobs.process`: does one job, within limits, and tells how far it is.

It reads what to do as JSON on stdin, and writes a line of JSON at a time on stdout: {"progress", "message"}, then
{"done"} or {"failed", "detail"}. Its working folder holds the files in `input`; the result is to be `result` there, and
a fitted model `model.npz`. It dies with the service.
"""

import ctypes
import errno
import faulthandler
import os
import re
import resource
import signal
import sys
from pathlib import Path
from typing import Any

import orjson

_NICE = 10
_FILE_BYTES = 2 << 30  # of any file that it writes
_FILES_OPEN = 256
_MUCH = 0.8  # of the memory: an error after that is a lack of memory
_PR_SET_PDEATHSIG = 1


def limit(memory: int, cpu: float, parent: int) -> None:
    """Bind this process.

    Args:
        memory: bytes of address space.
        cpu: seconds of computing.
        parent: id of the process with which it dies.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
    os.nice(_NICE)
    soft = int(cpu) + 1
    for what, most in (
        (resource.RLIMIT_AS, (memory, memory)), (resource.RLIMIT_CPU, (soft, soft + 5)),
        (resource.RLIMIT_CORE, (0, 0)), (resource.RLIMIT_FSIZE, (_FILE_BYTES, _FILE_BYTES)),
        (resource.RLIMIT_NOFILE, (_FILES_OPEN, _FILES_OPEN)),
    ):  # fmt: skip
        resource.setrlimit(what, most)


class Voice:
    """Words to the service.

    Args:
        handle: where to.
    """

    def __init__(self, handle: int):
        self._handle = handle

    def say(self, **words: Any) -> None:
        """One line."""
        os.write(self._handle, orjson.dumps(words) + b"\n")

    def progress(self, share: float, message: str) -> None:
        """How far it is."""
        self.say(progress=share, message=message)


def main() -> None:
    """Do what stdin says."""
    work = orjson.loads(sys.stdin.buffer.read())
    voice = Voice(os.dup(1))
    os.dup2(2, 1)  # what libraries print must not be taken for our words
    faulthandler.enable()
    limits = work["limits"]
    limit(limits["memory"], limits["cpu"], limits["parent"])
    try:
        _do(work, voice)
    except Exception as error:
        if not isinstance(error, MemoryError) and _peak() < _MUCH * limits["memory"]:
            raise
        gigabytes = limits["memory"] / 1e9
        voice.say(failed=422, detail=f"this needs more than the {gigabytes:g} GB of memory that a job gets")


def _peak() -> int:
    """Most bytes of address space that this process has had: what libraries raise without them has many names."""
    status = Path("/proc/self/status")
    found = re.search(r"VmPeak:\s+(\d+) kB", status.read_text()) if status.exists() else None
    return 1024 * int(found[1]) if found else 0


def _do(work: dict[str, Any], voice: Voice) -> None:
    """The work, and how it ended."""
    from motionenv import MotionError
    from service.jobs import work as kinds

    try:
        kinds.KINDS[work["kind"]](work["settings"], Path.cwd(), voice.progress)
        voice.say(done=True)
    except (MotionError, OSError) as error:
        cause = error if isinstance(error, OSError) else error.__cause__
        full = isinstance(cause, OSError) and cause.errno in (errno.ENOSPC, errno.EDQUOT)
        if not full and not isinstance(error, MotionError):
            raise
        detail = str(error).replace(f"{Path.cwd()}{os.sep}", "").replace(f"input{os.sep}", "")
        voice.say(failed=507 if full else 422, detail=detail)


if __name__ == "__main__":
    main()
