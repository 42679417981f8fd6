"""`python -m service.jobs.worker`: run one job within resource limits.

It reads the job as JSON from stdin and writes JSON lines to stdout: {"progress", "message"}, then {"done"} or
{"failed", "detail"}. Its working folder holds the files in `input` and receives `result`, and `model.npz` for a fit. It
dies with the service.
"""

import ctypes
import errno
import faulthandler
import os
import re
import resource
import signal
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import orjson

_NICE = 10
_FILE_BYTES = 2 << 30  # maximum size of a file that it writes
_FILES_OPEN = 256
_MUCH = 0.8  # share of the memory limit above which an error means too little memory
_PR_SET_PDEATHSIG = 1


def limit(memory: int, cpu: float, parent: int) -> None:
    """Limit address space [bytes] and CPU time [s] of this process, which dies with the process `parent`."""
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


def _send(handle: int, **message: Any) -> None:
    os.write(handle, orjson.dumps(message) + b"\n")


def main() -> None:
    """Run the job from stdin."""
    work = orjson.loads(sys.stdin.buffer.read())
    send = partial(_send, os.dup(1))
    os.dup2(2, 1)  # keep the output of libraries out of the messages
    faulthandler.enable()
    limits = work["limits"]
    limit(limits["memory"], limits["cpu"], limits["parent"])
    try:
        _do(work, send)
    except Exception as error:
        if not isinstance(error, MemoryError) and _peak() < _MUCH * limits["memory"]:
            raise
        gigabytes = limits["memory"] / 1e9
        send(failed=422, detail=f"the job exceeded its memory limit of {gigabytes:g} GB")


def _peak() -> int:
    """Peak address space [bytes]: out of memory, libraries raise many kinds of exceptions."""
    status = Path("/proc/self/status")
    found = re.search(r"VmPeak:\s+(\d+) kB", status.read_text()) if status.exists() else None
    return 1024 * int(found[1]) if found else 0


def _do(work: dict[str, Any], send: Callable[..., None]) -> None:
    from motionenv import MotionError
    from service.jobs import tasks as kinds

    try:
        progress = lambda share, message: send(progress=share, message=message)
        kinds.KINDS[work["kind"]](work["settings"], Path.cwd(), progress)
        send(done=True)
    except (MotionError, OSError) as error:
        cause = error if isinstance(error, OSError) else error.__cause__
        full = isinstance(cause, OSError) and cause.errno in (errno.ENOSPC, errno.EDQUOT)
        if not full and not isinstance(error, MotionError):
            raise
        send(failed=507 if full else 422, detail=kinds.plain(str(error)))


if __name__ == "__main__":
    main()
