"""Capture files into memory: the reader is picked by the file's suffix."""

from collections.abc import Callable
from pathlib import Path

from motionenv.errors import FormatError
from motionenv.mocap import asfamc, bvh, c3d, npz, trc
from motionenv.types import Markers, Motion

#: The reader of each suffix, and which options of `read` it takes.
_READERS: dict[str, tuple[Callable[..., Markers | Motion], set[str]]] = {
    ".amc": (asfamc.read, {"fps", "unit", "asf"}),
    ".bvh": (bvh.read, {"fps", "unit"}),
    ".c3d": (c3d.read, {"fps", "unit", "up"}),
    ".trc": (trc.read, {"fps", "unit", "up"}),
    ".npz": (npz.read, set()),
}


def read(
    path, *, fps: float | None = None, unit: str | float | None = None, up: str | None = None, asf=None
) -> Markers | Motion:
    """Read a capture file by its suffix: .amc (with its .asf), .bvh, .c3d, .trc or motionenv's own .npz.

    Args:
        path: the file.
        fps: frames per second, where the file doesn't say (AMC never does) or says it wrong.
        unit: a name in `motionenv.mocap.world.METRES` or metres per file unit, where the file doesn't say.
        up: "x", "y" or "z", the axis of a C3D or TRC file that points up, where it isn't as usual.
        asf: the skeleton of an AMC file, if not the one beside it.

    Returns:
        `Motion` of an NPZ file, `Markers` of every other: positions [m], z up, right-handed.

    Raises:
        FormatError: another suffix, an option that the format has no use for, or a file that can't be read as what
            its suffix says; names what is wrong where.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raise FormatError(path, f"can't be read by its suffix {suffix!r}; there are readers for {', '.join(_READERS)}")
    reader, allowed = _READERS[suffix]
    given = {"fps": fps, "unit": unit, "up": up, "asf": asf}
    options = {key: value for key, value in given.items() if value is not None}
    if needless := set(options) - allowed:
        raise FormatError(path, f"{', '.join(sorted(needless))} can't be given for a {suffix} file")
    return reader(path, **options)
