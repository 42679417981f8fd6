"""Events, clinical angles and measurements in the ezc3d representation of a file."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from motionenv.errors import MotionError
from motionenv.mocap.writers.common import Angles, checked_angles
from motionenv.types import Event, Recording

_MOST = 255  # entries of a parameter: its dimensions are bytes

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


def add_events(file: Any, events: Sequence[Event], fps: float, first: int, subject: str) -> None:
    """Add the group EVENT to a file of ezc3d, in the order of time (the C3D file format user guide, c3d.org).

    Events are named as Vicon's. Their times are since the first frame, whose number is `first`; the file's count from
    frame 1, at `fps` frames per second.
    """
    if len(events) > _MOST:
        raise MotionError(f"a C3D file has at most {_MOST} events, got {len(events)}: cut the trial, or pass fewer")
    if bad := [event for event in events if not np.isfinite(event.time)]:
        raise MotionError(f"events must have finite times, got {bad[0]}")
    if not events:
        return
    ordered = sorted(events, key=lambda event: event.time)
    seconds = np.array([event.time for event in ordered]) + (first - 1) / fps
    minutes = np.floor(seconds / 60)
    labels, descriptions, icons = zip(*(_KINDS[event.kind] for event in ordered), strict=True)
    for name, value in (
        ("CONTEXTS", [event.side.title() for event in ordered]),
        ("LABELS", list(labels)),
        ("DESCRIPTIONS", list(descriptions)),
        ("SUBJECTS", [subject] * len(ordered)),
        ("TIMES", np.stack([minutes, seconds - 60 * minutes])),
    ):
        file.add_parameter("EVENT", name, value)
    for name, numbers in (("USED", [len(ordered)]), ("ICON_IDS", list(icons)), ("GENERIC_FLAGS", [0] * len(ordered))):
        _add_whole(file, "EVENT", name, numbers)


def _add_whole(file: Any, group: str, name: str, numbers: list[int]) -> None:
    """Add a parameter of whole numbers, which `ezc3d.c3d.add_parameter` would make floats."""
    from ezc3d.ezc3d import Parameter, VecInt

    parameter = Parameter(name)
    parameter.set(VecInt(numbers))
    file["parameters"].add_parameter(group, parameter)


def angle_points(angles: Angles | None, frames: int) -> dict[str, np.ndarray]:
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


def add_measurements(file: Any, recording: Recording) -> None:
    """Add the subject's name and the numbers of the group PROCESSING, such as the leg length, of a recording."""
    if recording.subject:
        _add_whole(file, "SUBJECTS", "USED", [1])
        file.add_parameter("SUBJECTS", "NAMES", [recording.subject])
    for key, value in recording.parameters.items():
        group, _, name = key.partition(":")
        if group == "PROCESSING":
            file.add_parameter(group, name, [float(value)])
