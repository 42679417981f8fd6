"""Script that reads a C3D file with ezc3d and writes an NPZ to stdout; run by `motionenv.mocap.readers.c3d`.

It runs in a separate process, because ezc3d can crash or allocate all memory on a damaged file. It doesn't import
motionenv, so that it starts fast.
"""

import ctypes
import io
import os
import signal
import sys
from contextlib import suppress

_MEMORY = 1 << 30  # [bytes] address space for Python and its libraries
_PER_BYTE = 64  # additional bytes per byte of the file: 2 to 4 bytes become a double, of which there are copies
_PR_SET_PDEATHSIG = 1
_WANTED = ("LABELS", "UNITS", "RATE", "Y_SCREEN", "ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")


def text(value: str) -> str:
    """`value` with bytes that aren't UTF-8 decoded as Latin-1, which Windows programs write."""
    raw = value.encode(errors="surrogateescape")
    try:
        return raw.decode()
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def main(path: str) -> None:
    """Write positions (points, frames, 3), residuals and the POINT parameters of the file at `path`."""
    if sys.platform == "linux":  # end with the parent process: some damaged files cause endless loops
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    with suppress(ImportError):  # Windows has no resource limits
        import resource

        limit = _MEMORY + _PER_BYTE * os.path.getsize(path)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    import ezc3d
    import numpy as np

    c3d = ezc3d.c3d(path)
    points = c3d["data"]["points"]
    found = {
        "points": np.moveaxis(points[:3], 0, -1),
        "residuals": c3d["data"]["meta_points"]["residuals"][0],
        "header_rate": np.array(c3d["header"]["points"]["frame_rate"], dtype=float),
    }
    for name, parameter in c3d["parameters"]["POINT"].items():
        if name.startswith(_WANTED):
            values = parameter["value"]
            found[f"POINT:{name}"] = np.array([text(v) if isinstance(v, str) else v for v in values])
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **found)
    sys.stdout.buffer.write(out.getvalue())


if __name__ == "__main__":
    main(sys.argv[1])
