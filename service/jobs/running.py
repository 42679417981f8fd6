"""One job in a process of its own: begun, listened to, and killed when it takes too long or isn't wanted any more."""

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import orjson
import structlog

import service
from service.jobs.blobs import telling_full

_log = structlog.get_logger("motionenv.service")
#: What the process may know of our environment: no keys.
_KEPT = ("PATH", "HOME", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "NUMBA_CACHE_DIR", "MOTIONENV_CACHE",
         "XDG_CACHE_HOME", "PYOPENGL_PLATFORM")  # fmt: skip
_LOGGED = 4000  # bytes of what a process that failed has said
_CRASHES = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}


class Interrupted(Exception):
    """A job's process was killed by somebody else."""


class Failed(Exception):
    """A job has failed.

    Args:
        status: of HTTP: 422 where the input is to blame, 500 where we are, 507 for a full disk.
        detail: what was wrong, and what to do.
    """

    def __init__(self, status: int, detail: str):
        super().__init__(detail)
        self.status, self.detail = status, detail


async def run(
    work: dict[str, Any], folder: Path, seconds: float, memory: int, on_progress: Callable[[float, str], None]
) -> None:
    """Have the work done in a process that dies with ours.

    Args:
        work: kind, settings and file names, as `service.jobs.process` takes them.
        folder: where the process works: its files are in `input`, its result is to be `result`.
        seconds: that it may take.
        memory: bytes of address space that it may take.
        on_progress: called with a share and words as it goes.

    Raises:
        Failed: says why.
        Full: the disk is full.
        Interrupted: the process was killed.
    """
    limits = {"memory": memory, "cpu": seconds * (os.cpu_count() or 1), "parent": os.getpid()}
    with telling_full():
        (folder / "work").write_bytes(orjson.dumps({**work, "limits": limits}))
    # Popen's vfork: the event loop's own way forks, which waits for ever for OpenBLAS where other threads compute.
    with (folder / "work").open("rb") as asked, (folder / "log").open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "service.jobs.process"], cwd=folder, env=_environment(folder),
            stdin=asked, stdout=subprocess.PIPE, stderr=said, start_new_session=True,
        )  # fmt: skip
    try:
        async with asyncio.timeout(seconds):
            done = await _heard(process, on_progress)
            await asyncio.to_thread(os.waitid, os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    except TimeoutError:
        raise Failed(422, f"this took longer than {seconds:g} s, all that a job gets: ask for less") from None
    finally:
        os.killpg(process.pid, signal.SIGKILL)  # before it is waited for, its id is nobody else's
        code = await asyncio.to_thread(process.wait)
    if code == -signal.SIGKILL and not done:
        raise Interrupted
    if not done:
        raise _failure(code, folder / "log", memory)


async def _heard(process: subprocess.Popen, on_progress: Callable[[float, str], None]) -> bool:
    """Listen until the process ends; whether it said that the work is done.

    Raises:
        Failed: it said that it failed.
    """
    reader = asyncio.StreamReader()
    transport, _ = await asyncio.get_running_loop().connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(reader), process.stdout
    )
    done = False
    try:
        async for line in reader:
            said = orjson.loads(line)
            if "failed" in said:
                raise Failed(int(said["failed"]), str(said["detail"])[:2000])
            done = done or bool(said.get("done"))
            if "progress" in said:
                on_progress(min(max(float(said["progress"]), 0.0), 1.0), str(said["message"])[:200])
    except (ValueError, KeyError, TypeError) as error:  # not our words: something else got hold of the process
        raise Failed(500, "the job's process said what can't be understood") from error
    finally:
        transport.close()
    return done


def _failure(code: int, log: Path, memory: int) -> Failed:
    """What the end of a process means that said neither that it is done nor that it failed."""
    said = log.read_bytes()[-_LOGGED:].decode("utf-8", "replace")
    _log.warning("job's process ended", code=code, said=said)
    if -code in _CRASHES:
        return Failed(
            422, f"the process that read the files crashed ({signal.Signals(-code).name}): a file is damaged, or needs "
            f"more than the {memory / 1e9:g} GB of memory that a job gets",
        )  # fmt: skip
    if code == -signal.SIGXCPU:
        return Failed(422, "this took more computing time than a job gets: ask for less")
    return Failed(500, "the job's process ended without a result: this is a defect of the service: please report it")


def _environment(folder: Path) -> dict[str, str]:
    """Variables of the process: it finds this very code, leaves nothing behind, and numerics take one thread."""
    code = str(Path(service.__file__).parents[1])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return (
        {name: os.environ[name] for name in _KEPT if name in os.environ}
        | threads
        | {"PYTHONPATH": code, "TMPDIR": str(folder)}
    )
