"""Run a job in a child process: start it, read its progress, kill it on time-out or cancellation."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import orjson
import structlog

import service
from service.jobs.store import full_disk_errors

_log = structlog.get_logger("motionenv.service")
#: Environment variables that the process inherits: no keys.
_INHERITED = ("PATH", "HOME", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "NUMBA_CACHE_DIR", "MOTIONENV_CACHE",
         "XDG_CACHE_HOME")  # fmt: skip
_LOGGED = 4000  # bytes of a failed process's output
_CRASHES = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}


class Interrupted(Exception):
    """A job's process was killed from outside."""


class Failed(Exception):
    """A job failed: status 422 for invalid input, 500 for an internal error, 507 for a full disk."""

    def __init__(self, status: int, detail: str) -> None:
        super().__init__(detail)
        self.status, self.detail = status, detail


async def run(
    work: dict[str, Any], folder: Path, seconds: float, memory: int,
    on_progress: Callable[[float, str], Awaitable[None]],
) -> None:  # fmt: skip
    """Run a job in a process that dies with this one, in `folder`, with files in `input`; it writes `result`.

    `work` is kind and settings, as `service.jobs.worker` expects them, `memory` a limit of address space [bytes];
    `on_progress` is awaited with a share from 0 to 1 and a message.

    Raises:
        Failed: with the reason.
        Full: the disk is full.
        Interrupted: the process was killed.
    """
    limits = {"memory": memory, "cpu": seconds * (os.cpu_count() or 1), "parent": os.getpid()}
    with full_disk_errors():
        (folder / "work").write_bytes(orjson.dumps({**work, "limits": limits}))
    # Not a pipe: uvloop closes one's descriptor twice, and between the two another thread may have opened a file as it.
    ours, theirs = socket.socketpair()
    # Popen uses vfork; asyncio's subprocesses fork, which deadlocks in OpenBLAS while other threads compute.
    with theirs, (folder / "work").open("rb") as asked, (folder / "log").open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "service.jobs.worker"], cwd=folder, env=_environment(folder),
            stdin=asked, stdout=theirs.fileno(), stderr=said, start_new_session=True,
        )  # fmt: skip
    try:
        async with asyncio.timeout(seconds):
            done = await _read_progress(ours, on_progress)
            await asyncio.to_thread(os.waitid, os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    except TimeoutError:
        raise Failed(422, f"the job exceeded its time limit of {seconds:g} s: request less") from None
    finally:
        os.killpg(process.pid, signal.SIGKILL)  # before waiting: until then its id can't be reused
        code = await asyncio.to_thread(process.wait)
    if code == -signal.SIGKILL and not done:
        raise Interrupted
    if not done:
        raise _failure(code, folder / "log", memory)


async def _read_progress(output: socket.socket, on_progress: Callable[[float, str], Awaitable[None]]) -> bool:
    reader, writer = await asyncio.open_connection(sock=output)
    done = False
    try:
        async for line in reader:
            said = orjson.loads(line)
            if "failed" in said:
                raise Failed(int(said["failed"]), str(said["detail"])[:2000])
            done = done or bool(said.get("done"))
            if "progress" in said:
                await on_progress(min(max(float(said["progress"]), 0.0), 1.0), str(said["message"])[:200])
    except (ValueError, KeyError, TypeError) as error:  # not written by the worker
        raise Failed(500, "the job's process sent malformed output") from error
    finally:
        writer.close()
    return done


def _failure(code: int, log: Path, memory: int) -> Failed:
    said = log.read_bytes()[-_LOGGED:].decode("utf-8", "replace")
    _log.warning("job's process ended", code=code, said=said)
    if -code in _CRASHES:
        return Failed(
            422, f"the process that read the files crashed ({signal.Signals(-code).name}): a file is damaged, or needs "
            f"more than the memory limit of {memory / 1e9:g} GB",
        )  # fmt: skip
    if code == -signal.SIGXCPU:
        return Failed(422, "the job exceeded its limit of CPU time: request less")
    return Failed(500, "the job's process ended without a result: internal error, please report it")


def _environment(folder: Path) -> dict[str, str]:
    code = str(Path(service.__file__).parents[1])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return (
        {name: os.environ[name] for name in _INHERITED if name in os.environ}
        | threads
        | {"PYTHONPATH": code, "TMPDIR": str(folder)}
    )
