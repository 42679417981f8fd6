"""Read capture files; the suffix selects the reader."""

from collections.abc import Callable
from pathlib import Path

from motionenv.errors import FormatError
from motionenv.mocap import npz
from motionenv.mocap.readers import asfamc, bvh, c3d, trc
from motionenv.types import Markers, Motion

#: The reader of each suffix, and the options of `read` that it accepts.
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
    """Read a capture file: .amc (with its .asf), .bvh, .c3d, .trc or motionenv's own .npz.

    Args:
        path: the file.
        fps: frame rate, if the file doesn't specify it (AMC never does) or is wrong.
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres per file unit, if the file doesn't specify it.
        up: vertical axis of a C3D or TRC file, "x", "y" or "z", if it isn't the usual one.
        asf: the skeleton of an AMC file, if not the one in the same folder.

    Returns:
        `Motion` of an NPZ file, `Markers` of every other: positions [m], z up, right-handed.

    Raises:
        FormatError: another suffix, an option that the format doesn't support, or a malformed file; names the place.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raise FormatError(path, f"has suffix {suffix!r}; supported are {', '.join(_READERS)}")
    reader, allowed = _READERS[suffix]
    given = {"fps": fps, "unit": unit, "up": up, "asf": asf}
    options = {key: value for key, value in given.items() if value is not None}
    if needless := set(options) - allowed:
        raise FormatError(path, f"{', '.join(sorted(needless))} can't be given for a {suffix} file")
    return reader(path, **options)
