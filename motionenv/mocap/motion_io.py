"""Read capture files as a motion of the body, or summarise them."""

from pathlib import Path

import numpy as np

from motionenv.errors import MotionError
from motionenv.mocap.marker_sets import MarkerMap, find_landmarks
from motionenv.mocap.reading import read
from motionenv.mocap.retargeting import retarget
from motionenv.mocap.units_axes import METRES
from motionenv.types import Markers, Motion, Recording

_UNITS = {metres: f"unit {name}" for name, metres in METRES.items()}


def read_motion(
    path: str | Path, *, fps: float | None = None, unit: str | float | None = None,
    marker_map: MarkerMap | str | None = None, static: str | Path | None = None, body_model: str | Path | None = None,
    override: bool = True,
) -> Motion:  # fmt: skip
    """Read the motion in a file; capture is retargeted to the body.

    Args:
        path: .npz, .amc, .bvh, .c3d or .trc.
        fps: frame rate, if the file doesn't specify it or is wrong.
        unit: unit of length, if the file doesn't specify it or is wrong.
        body_model: for AMASS's files of poses: the NPZ file of the body model.
        marker_map: which points are which landmarks; see `motionenv.retarget`.
        static: file of a standing trial of the same person.
        override: whether `fps` and `unit` replace what the file states; False uses them only where it states nothing.

    Raises:
        MotionError: as in `motionenv.read` and `motionenv.retarget`.
    """
    loaded = read(path, fps=fps, unit=unit, body_model=body_model, override=override)
    if isinstance(loaded, Motion):
        return loaded
    standing = None if static is None else read_static(static, unit=unit)
    try:
        return retarget(loaded, marker_map=marker_map, static=standing)
    except MotionError as error:
        raise type(error)(f"{path}: {error}") from error


def read_static(path: str | Path, *, fps: float | None = None, unit: str | float | None = None) -> Markers:
    """Read the markers of a standing trial, .c3d or .trc.

    `fps` and `unit` are for files at `path` that don't specify them.

    Raises:
        MotionError: the file can't be read, or holds no markers.
    """
    capture = read(path, fps=fps, unit=unit, override=False)
    if not isinstance(capture, Markers):
        raise MotionError(f"{path}: a standing trial must hold markers (.c3d or .trc)")
    return capture


def describe(
    path: str | Path, *, fps: float | None = None, unit: str | float | None = None, body_model: str | Path | None = None
) -> str:
    """Summary of a capture file, in a few lines; takes `path`, `fps`, `unit` and `body_model` as `read_motion` does.

    Raises:
        MotionError: as in `motionenv.read`.
    """
    held = read(path, fps=fps, unit=unit, body_model=body_model)
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
    """The marker set that the names are of, and what is wrong with them."""
    try:
        found = find_landmarks(markers)
    except MotionError as error:
        return [str(error)]
    known = f"marker set {found.marker_set}: {len(found.points)} of its {len(found.marker_map.points)} landmarks"
    return [known if found.points else "no marker set has these names: see motionenv mocap map --help", *found.notes]


def _recording_lines(recording: Recording) -> list[str]:
    """What a file holds beside its points, in up to two lines."""
    per_metre = f"{1 / recording.metres:.6g} units of length per metre"
    held = [
        f"subject {recording.subject}" if recording.subject else "",
        _counted(len(recording.events), "event"),
        _counted(len(recording.plates), "force plate"),
        _UNITS.get(recording.metres, per_metre),
    ]
    lines = [", ".join(part for part in held if part)]
    if angles := [name for name in recording.outputs if "angle" in name.lower()]:
        lines.append(f"stored angles: {', '.join(angles)}")
    return lines


def _counted(count: int, what: str) -> str:
    """The count and the word, such as "2 events"; "" for none."""
    return f"{count} {what}{'s' if count > 1 else ''}" if count else ""
