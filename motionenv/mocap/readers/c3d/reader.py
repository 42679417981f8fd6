"""The reader of C3D files.

The libraries `ezc3d` and `c3d` each refuse files that are whole, and crash or hang on damaged ones; the tests compare
with both.
"""

import re
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.people import choose, prefix_of
from motionenv.mocap.readers.c3d._data import Layout, analog_channels, read_layout, read_points
from motionenv.mocap.readers.c3d._parameters import Parameters, read_encoding, read_parameters
from motionenv.mocap.readers.c3d.force_plates import Analog, plates_up, read_plates
from motionenv.mocap.readers.text import given_fps, read_bytes, unique
from motionenv.mocap.units_axes import stated_metres, upright
from motionenv.types import Event, Markers, Recording


def read(
    path: str | Path, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    person: str | None = None, override: bool = True,
) -> Markers:  # fmt: skip
    """Read the markers and virtual points of a C3D file, and what it holds beside them.

    All encodings are read: integers and floats of Intel, DEC and SGI/MIPS processors. A subject's name in front of a
    label ("Subject:NAME") is removed, that of a rigid body beside a person isn't; repeated labels get "_2", "_3".
    Negative residuals and points at exactly (0, 0, 0) are gaps: NaN. Where the header and the parameters disagree about
    the number of frames, points or analog values, those that account for the file's length are used.

    Args:
        path: the file.
        fps: frame rate; overrides the file's POINT:RATE.
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres per unit; overrides the file's POINT:UNITS.
        up: the file's vertical axis, "x", "y" or "z"; None uses POINT:Y_SCREEN; without it, the axis to which the
            force plates are perpendicular; without those, "z".
        person: of several people, whose names stand in front of their points' labels, the one to read; None takes the
            one with the most landmarks, with a note.
        override: whether `fps` and `unit` replace what the file states; False uses them only where it states nothing.

    Returns:
        Positions [m], z up. Its `recording` has the events, force plates of types 1 to 4, single numbers of the
        parameters, and the angles, forces, moments, powers and scalars that the file stores as points.

    Raises:
        FormatError: not a complete C3D file, one without frames or points, or a frame rate, unit or axis that must be
            given; names the block or the parameter.
    """
    raw = read_bytes(path)
    encoding = read_encoding(path, raw)
    parameters = read_parameters(raw, encoding)
    layout = read_layout(path, raw, encoding, parameters)
    labels = _labels(path, parameters, layout.points)
    points, stored = read_points(path, raw, encoding, layout)
    results = result_names(parameters, labels)
    kept = [i for i, label in enumerate(labels) if label not in results]
    metres = stated_metres(path, parameters.text("POINT:UNITS"), points[:, kept], unit, override, "POINT:UNITS")
    subjects = parameters.texts("SUBJECTS:NAMES")
    choice = choose(path, [labels[i] for i in kept], points[:, kept] * metres, person, subjects)
    kept = [kept[i] for i in choice.kept]
    names = unique(name or "unlabelled" for name in choice.names)
    up, fps = _up(path, parameters, up), given_fps(fps, override, lambda: _fps(path, parameters, layout))
    others = [
        i for i, label in enumerate(labels) if label in results and prefix_of(label, subjects) not in choice.others
    ]
    bare = unique(labels[i].rpartition(":")[2].strip() or "unlabelled" for i in others)
    outputs = zip(bare, others, strict=True)
    channels = analog_channels(parameters, layout, stored) if parameters.number("FORCE_PLATFORM:USED") > 0 else None
    positions = upright(points[:, kept] * metres, up)
    events, notes = read_events(parameters, layout, fps, choice.others)
    recording = Recording(
        subject=choice.person or read_subject(parameters, labels), first_frame=layout.first,
        events=events,
        plates=() if channels is None else read_plates(
            Analog(parameters, layout, channels, metres, up, fps, positions)
        ),
        parameters=read_numbers(parameters), metres=metres, outputs={name: points[:, i] for name, i in outputs},
    )  # fmt: skip
    return Markers(names, positions, fps, name=Path(path).stem, recording=recording, notes=(*choice.notes, *notes))


def _labels(path, parameters: Parameters, points: int) -> list[str]:
    labels = parameters.texts("POINT:LABELS")
    if not any(labels) and not parameters.whole:
        problem = "the parameter section is damaged, and the points' labels are lost: export the file again"
        raise FormatError(path, problem, "POINT:LABELS")
    return [*labels[:points], *[""] * (points - len(labels))]


def _up(path, parameters: Parameters, up: str | None) -> str:
    if up is not None:
        return up
    written = parameters.text("POINT:Y_SCREEN").lower()
    if not written:
        return plates_up(parameters) or "z"
    if written.lstrip("+") not in ("x", "y", "z"):
        problem = f'the axis up the screen must be +X, +Y or +Z, got {written!r}; pass up=, e.g. up="z"'
        raise FormatError(path, problem, "POINT:Y_SCREEN")
    return written.lstrip("+")


def _fps(path, parameters: Parameters, layout: Layout) -> float:
    rates = [parameters.number("POINT:RATE"), layout.rate, parameters.number("TRIAL:CAMERA_RATE")]
    stated = next((float(rate) for rate in rates if 0 < rate < np.inf), None)
    if stated is None:
        raise FormatError(path, "doesn't specify its frame rate; pass fps= (--fps)", "POINT:RATE")
    return stated


#: Names of results that are stored as points where no list in the group POINT names them, after Vicon's conventions.
_RESULT = re.compile(r"[LR]?[A-Za-z]+(Angles?|Forces?|Moments?|Powers?|NormalisedGRF)V?")
_LISTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
_CONTACT = (
    "footstrike", "heelstrike", "initialcontact", "footcontact", "heelcontact", "footon", "touchdown", "strike",
    "contact", "ic", "hs", "fs", "fc", "td", "on",
)  # fmt: skip
_OFF = ("footoff", "toeoff", "finalcontact", "off", "fo", "to")
_KINDS = dict.fromkeys(_CONTACT, "initial_contact") | dict.fromkeys(_OFF, "toe_off")
_SIDES = {"left": "left", "right": "right", "l": "left", "r": "right"}
#: Groups that describe the file itself: their single numbers say nothing about the person.
_FILE = {"POINT", "ANALOG", "FORCE_PLATFORM", "TRIAL", "EVENT", "EVENT_CONTEXT", "MANUFACTURER", "SEG"}


def read_subject(parameters: Parameters, labels: Sequence[str]) -> str:
    """The person's name, or what stands before the colon of the points' labels; "" without."""
    for name in (*parameters.texts("SUBJECTS:NAMES"), *parameters.texts("SUBJECT:NAME")):
        if name.strip():
            return name.strip()
    return next((label.rpartition(":")[0].strip() for label in labels if ":" in label), "")


def read_numbers(parameters: Parameters) -> dict[str, float]:
    """The single numbers of all groups that don't describe the file itself."""
    found = {}
    for key in parameters.values:
        value = parameters.numbers(key)
        if value.size == 1 and key.partition(":")[0] not in _FILE:
            found[key] = float(value.ravel()[0])
    return found


def result_names(parameters: Parameters, labels: Sequence[str]) -> set[str]:
    """The labels of points that are no points in space: angles, forces, moments, powers and scalars."""
    listed = {label for kind in _LISTS for label in parameters.texts(f"POINT:{kind}")}
    return listed | {label for label in labels if _RESULT.fullmatch(label.rpartition(":")[2].strip())}


def read_events(
    parameters: Parameters, layout: Layout, fps: float, others: Sequence[str] = ()
) -> tuple[tuple[Event, ...], tuple[str, ...]]:
    """The contacts and toe-offs within the trial, in the order of time, and a note if there are mostly others.

    They are the header's if the parameters have none, and those of `others` in the file are left out. EVENT:TIMES are
    minutes and seconds, the header's are seconds, both since frame 1.
    """
    times = parameters.numbers("EVENT:TIMES").ravel(order="F")
    seconds = times[: len(times) // 2 * 2].reshape(-1, 2) @ [60.0, 1.0]
    labels, contexts, whose = (parameters.texts(f"EVENT:{name}") for name in ("LABELS", "CONTEXTS", "SUBJECTS"))
    every = zip_longest(seconds[: len(labels)], labels[: len(seconds)], contexts, whose, fillvalue="")
    named = [(second, label, context) for second, label, context, who in every if label and who not in others]
    found, outside = [], 0
    for second, label, context in named if labels else [(time, label, "") for time, label in layout.events]:
        meaning = _meaning(label, context)
        time = float(second) - (layout.first - 1) / fps
        if meaning and -0.5 < time * fps < layout.frames - 0.5:
            found.append(Event(min(max(time, 0.0), (layout.frames - 1) / fps), *meaning))
        elif meaning:
            outside += 1
    if outside <= len(found):
        return tuple(sorted(found, key=lambda event: event.time)), ()
    many = f"{outside} of {outside + len(found)} events of the file lie outside of its frames"
    return (), (f"{many}, whose first is {layout.first}: none is used",)


def _meaning(label: str, context: str) -> tuple[str, str] | None:
    """Kind and side of an event: "Foot Strike" in the context "Left", or "RHS", "Toe Off (left)"; None for others."""
    letters = "".join(c for c in label.lower() if c.isalpha())
    side = _SIDES.get(context.strip().lower())
    if letters in _KINDS:
        return (_KINDS[letters], side) if side else None
    for word, its in _SIDES.items():
        for rest in (letters.removeprefix(word), letters.removesuffix(word)):
            if rest != letters and rest in _KINDS:
                return _KINDS[rest], its
    return None
