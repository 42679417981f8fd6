"""Write motions and captures to files; the suffix selects the writer."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.errors import MotionError
from motionenv.mocap import npz
from motionenv.mocap.writers import bvh, c3d, csv, glb, mot, trc
from motionenv.mocap.writers.common import Angles, save
from motionenv.types import Event, Markers, Motion

_WRITERS: dict[str, Any] = {
    ".bvh": bvh, ".c3d": c3d, ".csv": csv, ".glb": glb, ".mot": mot, ".npz": npz, ".trc": trc,
}  # fmt: skip
_OF_MARKERS = (".c3d", ".trc")


def write(motion: Motion, path: str | Path, events: Sequence[Event] = (), angles: Angles | None = None) -> None:
    """Write a motion atomically, in the format of the suffix.

    - .npz: everything, to the bit, for motionenv; batched sequences and gaps (NaN) too.
    - .csv: poses and markers [m, rad], for statistics; gaps are empty fields.
    - .c3d: the 15 markers [mm], events and angles, for gait analysis; gaps have residual -1.
    - .trc: the 15 markers [mm], y up, for OpenSim; gaps are blanks.
    - .mot: coordinates of Rajagopal2015 [m, degrees], for OpenSim; refuses gaps.
    - .bvh: the skeleton and its joint angles [cm, degrees], for animation tools; refuses gaps.
    - .glb: the moving, coloured cylinder body [m], for viewers and web pages; refuses gaps.

    Formats that refuse gaps in time take motions in which limbs are missing in every frame, and leave those out.

    Args:
        motion: (frames, 25) poses and their skeleton.
        path: the file.
        events: of the motion; for .c3d.
        angles: clinical angles of the motion [degrees], with `names` and `values` (frames, angles); for .c3d.

    Raises:
        GapError: the motion has gaps in time, which the format can't represent.
        MotionError: another suffix, events or angles in a format that can't hold them, not one sequence, or the file
            can't be written.
    """
    _check_motion(motion)
    check_suffix(path)
    beside = _beside(path, events, angles)
    suffix = Path(path).suffix.lower()
    if suffix == ".npz":
        npz.write(motion, path)  # compressed, unlike `npz.encode`
    else:
        save(_WRITERS[suffix].encode(motion, **beside), path)


def write_markers(
    capture: Markers, path: str | Path, events: Sequence[Event] = (), angles: Angles | None = None
) -> None:
    """Write captured points under their own names, atomically, in the format of the suffix.

    A C3D file also gets the events and angles, and from `capture.recording` the subject, its measurements, the unit of
    length and the number of the first frame: a laboratory's own file with what was computed from it added. Analogue
    channels and force plates aren't written.

    Args:
        capture: one sequence (frames, points, 3) of at least one frame; gaps are NaN.
        path: the file, .c3d (z up) or .trc (OpenSim's axes: world x, y, z are its x, -z, y).
        events: of the capture; for .c3d. None given writes the recording's own.
        angles: clinical angles of the capture [degrees], with `names` and `values` (frames, angles); for .c3d.

    Raises:
        MotionError: another suffix, events or angles in a format that can't hold them, not one sequence, an infinite
            position, a name that the format can't hold, or the file can't be written.
    """
    _check_capture(capture)
    suffix = Path(path).suffix.lower()
    if suffix not in _OF_MARKERS:
        raise MotionError(
            f"can't write captured points to {path}: suffix {suffix!r} isn't supported; supported are "
            f"{', '.join(_OF_MARKERS)}. Other formats hold a body: retarget the points to one, and pass that to write"
        )
    save(_WRITERS[suffix].encode_markers(capture, **_beside(path, events, angles)), path)


def _beside(path: str | Path, events: Sequence[Event], angles: Angles | None) -> dict[str, Any]:
    """Those of the arguments `events` and `angles` that are given; only C3D files hold them."""
    given: dict[str, Any] = {"events": tuple(events)} if len(events) else {}
    if angles is not None:
        given["angles"] = angles
    suffix = Path(path).suffix.lower()
    if given and suffix != ".c3d":
        what = " and ".join(given)
        raise MotionError(f"can't write {path}: a {suffix} file holds no {what}, but .c3d does; pass none of them")
    return given


def encode(motion: Motion, suffix: str) -> Iterator[bytes]:
    """The bytes of the file that `write` would write, in parts that are made on demand.

    BVH, CSV, MOT and TRC are encoded a few hundred frames at a time, the others in one part. NPZ is not compressed, for
    speed. The `suffix` of a `motion` is as in `write`, such as ".bvh".

    Raises:
        GapError: the motion has gaps in time, which the format can't represent.
        MotionError: another suffix, or not one sequence.
    """
    _check_motion(motion)
    check_suffix(f"motion{suffix}")
    return _WRITERS[suffix.lower()].encode(motion)


def _check_motion(motion) -> None:
    if not isinstance(motion, Motion):
        raise MotionError(f"motion must be a Motion, got {type(motion).__name__}; retarget Markers to a body first")


def _check_capture(capture) -> None:
    if not isinstance(capture, Markers):
        raise MotionError(f"capture must be Markers, got {type(capture).__name__}; write takes a Motion")
    positions = capture.positions
    if positions.ndim != 3 or not positions.size:
        problem = "one sequence (frames, points, 3) with at least one frame and point"
        raise MotionError(f"capture.positions must be {problem}, got {positions.shape}: write batched ones one by one")
    if np.isinf(positions).any():
        frame, point, _ = np.argwhere(np.isinf(positions))[0]
        where = f"{capture.names[point]} of frame {frame}"
        raise MotionError(f"{where} is infinite; positions must be finite, or NaN where unknown")


def check_suffix(path: str | Path, others: Sequence[str] = ()) -> None:
    """Reject, before any work, paths whose suffix `write` doesn't support.

    `others` are suffixes that the caller itself writes.
    """
    suffix = Path(path).suffix.lower()
    known = (*others, *_WRITERS)
    if suffix not in known:
        raise MotionError(f"can't write {path}: suffix {suffix!r} isn't supported; supported are {', '.join(known)}")
