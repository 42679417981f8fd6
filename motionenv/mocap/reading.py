"""Read capture files, as they are or as a motion of the body, and summarise them; the suffix selects the reader."""

import unicodedata
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from motionenv._core.representation import counted
from motionenv.errors import CaptureWarning, FormatError, MotionError
from motionenv.mocap import npz
from motionenv.mocap.marker_sets import MarkerMap, find_landmarks
from motionenv.mocap.people import one_person
from motionenv.mocap.plausibility import find_doubts, mended
from motionenv.mocap.readers import amass, asfamc, bvh, c3d, tables, trc
from motionenv.mocap.retargeting import retarget
from motionenv.mocap.units_axes import METRES
from motionenv.types import Markers, Motion, Recording

#: The reader of each suffix, and the options of `read` that it accepts.
_READERS: dict[str, tuple[Callable[..., Any], set[str]]] = {
    ".amc": (asfamc.read, {"fps", "unit", "up", "asf"}),
    ".bvh": (bvh.read, {"fps", "unit", "up", "person"}),
    ".c3d": (c3d.read, {"fps", "unit", "up", "person"}), ".trc": (trc.read, {"fps", "unit", "up", "person"}),
    ".tsv": (tables.read, {"fps", "unit", "up", "person"}), ".csv": (tables.read, {"fps", "unit", "up", "person"}),
    ".npz": (npz.read, set()),
}  # fmt: skip

#: Suffixes of the files that can be read.
SUFFIXES = frozenset(_READERS)


def read(
    path: str | Path, *, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    person: str | None = None, asf: str | Path | None = None, body_model: str | Path | None = None,
    override: bool = True,
) -> Markers | Motion:  # fmt: skip
    """Read a capture file: .amc (with its .asf), .bvh, .c3d, .trc, motionenv's own .npz, AMASS's, or a table of points.

    Tables are Qualisys's .tsv, OptiTrack Motive's .csv, and plain ones with columns such as time, hip_x, hip_y, hip_z.

    Args:
        path: the file.
        fps: frame rate, if the file doesn't specify it (AMC never does) or is wrong.
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres per file unit, if the file doesn't specify it or
            is wrong.
        up: the file's vertical axis, "x", "y" or "z", if it isn't the usual one; motionenv's own has z up.
        person: of several people in the file, the one to read: what stands in front of the names of the person's
            points and a colon. None takes the one with the most landmarks; the result's `notes` say so.
        asf: the skeleton of an AMC file, if not the one in the same folder.
        body_model: for AMASS files of poses: the NPZ file of the body model.
        override: whether `fps` and `unit` replace what the file states. False uses them only where it states nothing,
            and ignores options that its format has no use for: for folders of files of all kinds.

    Returns:
        `Motion` of motionenv's NPZ files, `Markers` of every other: positions [m], z up, right-handed. A unit or a
        vertical axis that isn't given, and in which no person would stand, is replaced by the only one in which one
        does; samples at which a marker sticks in space are gaps. Notes and a `CaptureWarning` say so.

    Raises:
        FormatError: another suffix, an option that the format doesn't support, or a malformed file; names the place.
    """
    reader, allowed = _reader(path)
    given: dict[str, Any] = {"fps": fps, "unit": unit, "up": up, "person": person, "asf": asf, "body_model": body_model}
    options = {key: value for key, value in given.items() if value is not None}
    if not override:
        options = {key: value for key, value in options.items() if key in allowed}
    elif needless := set(options) - allowed:
        suffix = Path(path).suffix.lower()
        raise FormatError(path, f"{', '.join(sorted(needless))} can't be given for a {suffix} file")
    if not allowed:
        return reader(path)
    found = _read_once(path, override, options)

    def again(**other: str) -> Markers:
        if "unit" not in other:
            return _read_once(path, override, options | other)
        return _read_once(path, True, options | {"fps": found.fps} | other)  # the file states another unit

    stated = {"unit"} if body_model is not None else set()  # a body model is in metres
    found = mended(found, again, {"unit", "up"} & allowed - set(options) - stated)
    for note in found.notes:
        warnings.warn(f"{Path(path).name}: {note}", CaptureWarning, stacklevel=2)
    return found


def _reader(path: str | Path) -> tuple[Callable[..., Any], set[str]]:
    """The reader of a file, and the options that it takes."""
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raise FormatError(path, f"has suffix {suffix!r}; supported are {', '.join(_READERS)}")
    if suffix == ".npz" and _is_amass(path):
        return amass.read, {"fps", "unit", "up", "body_model"}
    return _READERS[suffix]


def _read_once(path: str | Path, override: bool, options: dict[str, Any]) -> Markers:
    reader, allowed = _reader(path)
    if reader is c3d.read:  # whose events and results are the person's too
        return c3d.read(path, override=override, **options)
    held = reader(path, override=override, **{key: value for key, value in options.items() if key != "person"})
    return one_person(path, held, options.get("person")) if "person" in allowed else held


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


_UNITS = {metres: f"unit {name}" for name, metres in METRES.items()}


def read_motion(
    path: str | Path, *, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    person: str | None = None, marker_map: MarkerMap | str | None = None, static: str | Path | None = None,
    body_model: str | Path | None = None, override: bool = True,
) -> Motion:  # fmt: skip
    """Read the motion in a file; capture is retargeted to the body.

    Args:
        path: a file of one of `SUFFIXES`.
        up, person: vertical axis, and the one of several people, as of `read`.
        fps: frame rate, if the file doesn't specify it or is wrong.
        unit: unit of length, if the file doesn't specify it or is wrong.
        body_model: for AMASS's files of poses: the NPZ file of the body model.
        marker_map: which points are which landmarks; see `motionenv.retarget`.
        static: file of a standing trial of the same person.
        override: whether `fps` and `unit` replace what the file states; False uses them only where it states nothing.

    A `CaptureWarning` tells what in the capture isn't plausible for a person.

    Raises:
        MotionError: as in `motionenv.read` and `motionenv.retarget`.
    """
    loaded = read(path, fps=fps, unit=unit, up=up, person=person, body_model=body_model, override=override)
    for doubt in find_doubts(loaded, marker_map):
        warnings.warn(f"{Path(path).name} is not plausible: {doubt}", CaptureWarning, stacklevel=2)
    if isinstance(loaded, Motion):
        return loaded
    standing = None if static is None else read_static(static, unit=unit, up=up)
    try:
        return retarget(loaded, marker_map=marker_map, static=standing)
    except MotionError as error:
        raise type(error)(f"{path}: {error}") from error


def read_static(
    path: str | Path, *, fps: float | None = None, unit: str | float | None = None, up: str | None = None
) -> Markers:
    """Read the markers of a standing trial, such as a .c3d or .trc file.

    `fps` and `unit` are for files at `path` that don't specify them, `up` as of `read`.

    Raises:
        MotionError: the file can't be read, or holds no markers.
    """
    capture = read(path, fps=fps, unit=unit, up=up, override=False)
    if not isinstance(capture, Markers):
        raise MotionError(f"{path}: a standing trial must hold markers (.c3d or .trc)")
    return capture


def describe(
    path: str | Path, *, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    person: str | None = None, body_model: str | Path | None = None,
) -> str:  # fmt: skip
    """Summary of a capture file, in a few lines.

    Takes `path`, `fps`, `unit`, `up`, `person` and `body_model` as `read` does.

    Raises:
        MotionError: as in `motionenv.read`.
    """
    held = read(path, fps=fps, unit=unit, up=up, person=person, body_model=body_model)
    if isinstance(held, Motion):
        points, values = "the 25-DOF body", held.poses
    else:
        points, values = f"{len(held.names)} points: {', '.join(held.names)}", held.positions
    frames = values.shape[-2] if isinstance(held, Motion) else values.shape[-3]
    gaps = float(np.isnan(values).mean())
    lines = [
        f"{Path(path).name}: {frames} frames, {frames / held.fps:.2f} s at {held.fps:g} fps, gaps {gaps:.1%}",
        points,
    ]
    if isinstance(held, Markers):
        lines += _marker_set_lines(held)
    if isinstance(held, Markers) and held.recording is not None:
        lines += _recording_lines(held.recording)
    return "\n".join(lines)


def _marker_set_lines(markers: Markers) -> list[str]:
    try:
        found = find_landmarks(markers)
    except MotionError as error:
        return [*markers.notes, str(error)]
    doubts = [f"not plausible: {doubt}" for doubt in find_doubts(markers)]
    known = f"marker set {found.marker_set}: {len(found.points)} of its {len(found.marker_map.points)} landmarks"
    named = known if found.points else "no marker set has these names: see motionenv mocap map --help"
    return [named, *markers.notes, *found.notes, *doubts]


def _recording_lines(recording: Recording) -> list[str]:
    per_metre = f"{1 / recording.metres:.6g} units of length per metre"
    held = [
        f"subject {recording.subject}" if recording.subject else "",
        counted(len(recording.events), "event") if recording.events else "",
        counted(len(recording.plates), "force plate") if recording.plates else "",
        _UNITS.get(recording.metres, per_metre),
    ]
    lines = [", ".join(part for part in held if part)]
    if angles := [name for name in recording.outputs if "angle" in name.lower()]:
        lines.append(f"stored angles: {', '.join(angles)}")
    return lines
