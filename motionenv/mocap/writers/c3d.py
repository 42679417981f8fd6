"""C3D writer: the body's 15 markers or captured points, with events and clinical angles beside them.

Files have Intel's byte order and float32 values (the C3D file format user guide, c3d.org).
"""

import struct
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from motionenv.body.kinematics import markers as body_markers
from motionenv.errors import MotionError
from motionenv.mocap.units_axes import METRES
from motionenv.mocap.writers.common import Angles, check_sequence, checked_angles
from motionenv.types import MARKERS, Event, Markers, Motion, Recording

_BLOCK = 512
_MOST = 255  # entries of a parameter and bytes of a text: the dimensions are bytes
_MOST_BYTES = 32767  # of a parameter: the offset of the next has 16 bits, with a sign in some readers
_FULL = 65535  # the header's counts have 16 bits
_LONG = 1 << 31  # and those of the group TRIAL twice as many

#: A parameter: one text, texts, or numbers, whose last axis is the fastest in the file.
_Value = str | Sequence[str] | int | float | np.ndarray

#: Vicon's label, description and icon of each kind of event.
_KINDS = {
    "initial_contact": ("Foot Strike", "The instant the heel strikes the ground", 1),
    "toe_off": ("Foot Off", "The instant the toe leaves the ground", 2),
}

#: Plug-in Gait's names of the points that hold angles, and what their x, y and z are.
_ANGLES = {
    "PelvisAngles": ("pelvis_tilt", "pelvis_obliquity", "pelvis_rotation"),
    "HipAngles": ("hip_flexion", "hip_adduction", "hip_rotation"),
    "KneeAngles": ("knee_flexion", "knee_adduction", "knee_rotation"),
    "AnkleAngles": ("ankle_dorsiflexion", "ankle_adduction", "ankle_rotation"),
    "FootProgressAngles": ("", "", "foot_progression"),
}


def encode(motion: Motion, events: Sequence[Event] = (), angles: Angles | None = None) -> Iterator[bytes]:
    """The bytes of a C3D file of the 15 markers of `motionenv.types.MARKERS`, in one part.

    Millimetres, z up and x forward (POINT:X_SCREEN +X, Y_SCREEN +Z); gaps have the residual -1. Events are written as
    Vicon's software writes them, angles as points with Plug-in Gait's names ("LKneeAngles").

    Args:
        motion: one sequence (frames, 25).
        events: of the motion, at most 255.
        angles: clinical angles of the motion [degrees]; a frame in which one of a joint's three is unknown is a gap.

    Raises:
        MotionError: not one sequence, too many events, angles of other frames or without known names.
    """
    check_sequence(motion, "C3D", gaps=True)
    positions = body_markers(motion.poses, motion.skeleton) / METRES["mm"]
    groups = {"EVENT": _events(events, motion.fps, 1, "")} if events else {}
    return iter([_file(MARKERS, positions, _angle_points(angles, len(positions)), motion.fps, "mm", 1, groups)])


def encode_markers(capture: Markers, events: Sequence[Event] = (), angles: Angles | None = None) -> Iterator[bytes]:
    """The bytes of a C3D file of captured points under their own names, in one part.

    The unit of length, the number of the first frame, the subject's name and the measurements of the group PROCESSING
    are those of `capture.recording`, if there is one; else millimetres and frame 1. z is up. Analogue channels and
    force plates aren't written. Without events, the recording's own are. Other arguments and errors are as in `encode`;
    too many points, names of over 255 bytes and a point with the name of an angle are errors too.
    """
    recording = capture.recording or Recording(metres=0.001)
    unit = next((name for name, metres in METRES.items() if np.isclose(metres, recording.metres, rtol=1e-6)), "mm")
    first = recording.first_frame if 1 <= recording.first_frame < _LONG else 1
    groups: dict[str, dict[str, _Value]] = {}
    if events := events or recording.events:
        groups["EVENT"] = _events(events, capture.fps, first, recording.subject)
    if METRES[unit] == recording.metres:
        groups |= _measurements(recording)
    angle_points = _angle_points(angles, len(capture.positions))
    return iter(
        [_file(capture.names, capture.positions / METRES[unit], angle_points, capture.fps, unit, first, groups)]
    )


def _file(
    names: tuple[str, ...], positions: np.ndarray, angles: dict[str, np.ndarray], fps: float, unit: str, first: int,
    groups: Mapping[str, Mapping[str, _Value]],
) -> bytes:  # fmt: skip
    """The file of positions (frames, points, 3) [unit], angles (frames, 3) and further groups of parameters."""
    if twice := sorted(set(names) & set(angles)):
        raise MotionError(f"there is a point with the name of an angle, {twice[0]}: rename it, or pass no angles")
    points = np.concatenate([positions, *(angle[:, None] for angle in angles.values())], axis=1)
    frames, count, _ = points.shape
    if count > _FULL:
        raise MotionError(f"a C3D file has at most {_FULL} points, got {count}: write several files")
    last = first + frames - 1
    point: dict[str, _Value] = {
        "USED": count, "SCALE": -1.0, "RATE": fps, "DATA_START": 0, "FRAMES": min(frames, _FULL),
        **_long("LABELS", [*names, *angles]), **_long("DESCRIPTIONS", [""] * count), "UNITS": unit, "X_SCREEN": "+X",
        "Y_SCREEN": "+Z",
    }  # fmt: skip
    if angles:
        point |= {"ANGLES": list(angles), "ANGLE_UNITS": ["deg"]}
    analog = {"USED": 0, "GEN_SCALE": 1.0, "RATE": 0.0}
    every: dict[str, Mapping[str, _Value]] = {"POINT": point, "ANALOG": analog, "FORCE_PLATFORM": {"USED": 0}, **groups}
    if last >= _FULL:
        words = [np.array([frame & _FULL, frame >> 16]) for frame in (first, last)]
        every["TRIAL"] = {"ACTUAL_START_FIELD": words[0], "ACTUAL_END_FIELD": words[1]}
        point["LONG_FRAMES"] = float(frames)
    start = 2 + len(_section(every)) // _BLOCK
    point["DATA_START"] = start
    header = struct.pack(
        "<BB5HfHHf", 2, 0x50, count, 0, min(first, _FULL), min(last, _FULL), 0, -1.0, start, 0, fps
    )  # the parameters' block, key, points, analogue values, frames, interpolated gaps, scale, data's block, ..., rate
    values = np.zeros((frames, count, 4), dtype="<f4")
    gap = np.isnan(points).any(-1)
    values[..., :3] = np.where(gap[..., None], 0.0, points)
    values[..., 3] = np.where(gap, -1.0, 0.0)
    parts = [header.ljust(_BLOCK, b"\0"), _section(every), values.tobytes()]
    if last < _FULL:  # else readers go on to the end of the file
        parts.append(bytes(-values.nbytes % _BLOCK))
    return b"".join(parts)


def _section(groups: Mapping[str, Mapping[str, _Value]]) -> bytes:
    """The parameter section, in whole blocks. Its own count of them has 8 bits, which long sections exceed."""
    records = []
    for number, (group, parameters) in enumerate(groups.items(), 1):
        records.append(_record(group, -number, b""))
        records += [_record(name, number, _value(f"{group}:{name}", value)) for name, value in parameters.items()]
    body = b"".join(records)
    blocks = (4 + len(body) + 2 + _BLOCK - 1) // _BLOCK  # at least two zeros end it
    return (bytes([1, 0x50, min(blocks, 255), 84]) + body).ljust(blocks * _BLOCK, b"\0")


def _record(name: str, group: int, value: bytes) -> bytes:
    """A group (its negative number) or a parameter of one, without description."""
    raw = name.encode()
    if len(raw) > 127 or len(value) > _MOST_BYTES - 3:
        raise MotionError(f"the parameter {name} has {len(value)} bytes, more than a C3D file can hold: shorten it")
    return struct.pack("<bb", len(raw), group) + raw + struct.pack("<H", 3 + len(value)) + value + b"\0"


def _value(key: str, value: _Value) -> bytes:
    """Type, dimensions and data of a parameter."""
    if isinstance(value, str):
        return _texts(key, [value], ())
    if not isinstance(value, int | float | np.ndarray):
        return _texts(key, value, (len(value),))
    numbers = np.asarray(value)
    kind, data = (2, numbers.astype("<u2")) if numbers.dtype.kind == "i" else (4, numbers.astype("<f4"))
    return bytes([kind, numbers.ndim, *numbers.shape[::-1]]) + data.tobytes()


def _texts(key: str, texts: Sequence[str], shape: tuple[int, ...]) -> bytes:
    raw = [text.encode() for text in texts]
    width = max(1, *map(len, raw))
    if width > _MOST:
        raise MotionError(f"a C3D file has texts of at most {_MOST} bytes, but one of {key} has {width}: shorten it")
    return bytes([0xFF, 1 + len(shape), width, *shape]) + b"".join(text.ljust(width) for text in raw)


def _long(name: str, texts: list[str]) -> dict[str, list[str]]:
    """Texts as a parameter and its continuations (LABELS2, LABELS3, ...), as many in each as it can hold."""
    width = max(1, *(len(text.encode()) for text in texts))
    each = max(1, min(_MOST, (_MOST_BYTES - 10) // width))
    starts = range(0, len(texts), each)
    return {f"{name}{i if i > 1 else ''}": texts[start : start + each] for i, start in enumerate(starts, 1)}


def _events(events: Sequence[Event], fps: float, first: int, subject: str) -> dict[str, _Value]:
    """The group EVENT, in the order of time.

    Times are since the first frame, whose number is `first`; the file's count from frame 1.
    """
    if len(events) > _MOST:
        raise MotionError(f"a C3D file has at most {_MOST} events, got {len(events)}: cut the trial, or pass fewer")
    if bad := [event for event in events if not np.isfinite(event.time)]:
        raise MotionError(f"events must have finite times, got {bad[0]}")
    ordered = sorted(events, key=lambda event: event.time)
    seconds = np.array([event.time for event in ordered]) + (first - 1) / fps
    minutes = np.floor(seconds / 60)
    labels, descriptions, icons = zip(*(_KINDS[event.kind] for event in ordered), strict=True)
    return {
        "USED": len(ordered), "CONTEXTS": [event.side.title() for event in ordered], "LABELS": labels,
        "DESCRIPTIONS": descriptions, "SUBJECTS": [subject] * len(ordered),
        "TIMES": np.stack([minutes, seconds - 60 * minutes], axis=1), "ICON_IDS": np.array(icons),
        "GENERIC_FLAGS": np.zeros(len(ordered), dtype=int),
    }  # fmt: skip


def _angle_points(angles: Angles | None, frames: int) -> dict[str, np.ndarray]:
    """Angles as points (frames, 3) [degrees] by Plug-in Gait's names; joints of which there are none are left out."""
    if angles is None:
        return {}
    columns = checked_angles(angles, frames)
    found = {}
    for side in ("left", "right"):
        for point, three in _ANGLES.items():
            keys = [f"{side}_{part}" if part else "" for part in three]
            if all(key in columns for key in keys if key):
                found[side[0].upper() + point] = np.stack([columns.get(key, np.zeros(frames)) for key in keys], axis=1)
    if not found:
        expected = ", ".join(name for three in _ANGLES.values() for name in three if name)
        raise MotionError(
            f"angles has no known name: expected left_ or right_ before {expected}; got {', '.join(columns)}"
        )
    return found


def _measurements(recording: Recording) -> dict[str, dict[str, _Value]]:
    groups: dict[str, dict[str, _Value]] = {}
    if recording.subject:
        groups["SUBJECTS"] = {"USED": 1, "NAMES": [recording.subject]}
    own = {key.removeprefix("PROCESSING:"): value for key, value in recording.parameters.items()
           if key.startswith("PROCESSING:")}  # fmt: skip
    return groups | ({"PROCESSING": {name: float(value) for name, value in own.items()}} if own else {})
