"""Locks between processes, which the system releases when their holder ends, however it ends."""

import errno
from typing import IO

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


def lock(file: IO, *, wait: bool = True) -> bool:
    """Lock an open file until it is closed; returns whether this process has it, which it always does after `wait`.

    Raises:
        OSError: the system, or the file system, has no such locks.
    """
    if fcntl is None:
        raise OSError(errno.ENOLCK, "no file locks on this system")
    try:
        fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
