"""Read capture files; the suffix selects the reader."""

import unicodedata
import zipfile
from collections.abc import Callable
from pathlib import Path

from motionenv.errors import FormatError
from motionenv.mocap import npz
from motionenv.mocap.readers import amass, asfamc, bvh, c3d, trc
from motionenv.types import Markers, Motion

#: The reader of each suffix, and the options of `read` that it accepts.
_READERS: dict[str, tuple[Callable[..., Markers | Motion], set[str]]] = {
    ".amc": (asfamc.read, {"fps", "unit", "asf"}), ".bvh": (bvh.read, {"fps", "unit"}),
    ".c3d": (c3d.read, {"fps", "unit", "up"}), ".trc": (trc.read, {"fps", "unit", "up"}), ".npz": (npz.read, set()),
}  # fmt: skip

#: Suffixes of the files that can be read.
SUFFIXES = frozenset(_READERS)


def read(
    path: str | Path, *, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    asf: str | Path | None = None, body_model: str | Path | None = None, override: bool = True,
) -> Markers | Motion:  # fmt: skip
    """Read a capture file: .amc (with its .asf), .bvh, .c3d, .trc, motionenv's own .npz, or AMASS's.

    Args:
        path: the file.
        fps: frame rate, if the file doesn't specify it (AMC never does) or is wrong.
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres per file unit, if the file doesn't specify it or
            is wrong.
        up: vertical axis of a C3D, TRC or AMASS file, "x", "y" or "z", if it isn't the usual one.
        asf: the skeleton of an AMC file, if not the one in the same folder.
        body_model: for AMASS files of poses: the NPZ file of the body model.
        override: whether `fps` and `unit` replace what the file states. False uses them only where it states nothing,
            and ignores options that its format has no use for: for folders of files of all kinds.

    Returns:
        `Motion` of motionenv's NPZ files, `Markers` of every other: positions [m], z up, right-handed.

    Raises:
        FormatError: another suffix, an option that the format doesn't support, or a malformed file; names the place.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raise FormatError(path, f"has suffix {suffix!r}; supported are {', '.join(_READERS)}")
    reader, allowed = _READERS[suffix]
    if suffix == ".npz" and _is_amass(path):
        reader, allowed = amass.read, {"fps", "unit", "up", "body_model"}
    given = {"fps": fps, "unit": unit, "up": up, "asf": asf, "body_model": body_model}
    options = {key: value for key, value in given.items() if value is not None}
    if not override:
        options = {key: value for key, value in options.items() if key in allowed}
    elif needless := set(options) - allowed:
        raise FormatError(path, f"{', '.join(sorted(needless))} can't be given for a {suffix} file")
    return reader(path, **options) if not allowed else reader(path, override=override, **options)


def person_label(path: str | Path) -> str:
    """The person's label from a file's `path`: what stands before the first "_" of its name, as in CMU's trials.

    Letters are composed (NFC): the same name may come decomposed from another operating system.
    """
    return unicodedata.normalize("NFC", Path(path).stem).partition("_")[0]


def _is_amass(path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return amass.is_amass(name.removesuffix(".npy") for name in archive.namelist())
    except (zipfile.BadZipFile, OSError):
        return False
