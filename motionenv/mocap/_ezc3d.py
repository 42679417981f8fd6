"""Run as a script by `motionenv.mocap.c3d`: reads one C3D file with ezc3d and writes what it found to stdout as NPZ.

A process of its own, because ezc3d can crash or ask for all memory on a damaged file. It imports nothing of
motionenv, so that it starts fast.
"""

import io
import sys
from contextlib import suppress

_MEMORY = 8 << 30  # [bytes] of address space; the largest gait captures need a few hundred MB


def main(path: str) -> None:
    """Write positions (points, frames, 3), residuals and the POINT parameters of the file at `path`."""
    with suppress(ImportError):  # Windows has no resource limits
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
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
        if name != "__METADATA__":
            found[f"POINT:{name}"] = np.array(parameter["value"])
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **found)
    sys.stdout.buffer.write(out.getvalue())


if __name__ == "__main__":
    main(sys.argv[1])
