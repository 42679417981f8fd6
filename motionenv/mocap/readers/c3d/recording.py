"""What a C3D file holds beside its points: the person, events, single numbers, other programs' results."""

import re
from collections.abc import Sequence

from motionenv.mocap.readers.c3d._data import Layout
from motionenv.mocap.readers.c3d._parameters import Parameters
from motionenv.types import Event

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


def read_events(parameters: Parameters, layout: Layout, fps: float) -> tuple[Event, ...]:
    """The contacts and toe-offs within the trial, in the order of time; the header's if the parameters have none.

    EVENT:TIMES are minutes and seconds, the header's are seconds, both since frame 1.
    """
    times = parameters.numbers("EVENT:TIMES").ravel(order="F")
    seconds = times[: len(times) // 2 * 2].reshape(-1, 2) @ [60.0, 1.0]
    labels, contexts = parameters.texts("EVENT:LABELS"), parameters.texts("EVENT:CONTEXTS")
    named = list(zip(seconds, labels, [*contexts, *[""] * len(labels)], strict=False))
    found = []
    for second, label, context in named or [(time, label, "") for time, label in layout.events]:
        meaning = _meaning(label, context)
        time = float(second) - (layout.first - 1) / fps
        if meaning and -0.5 < time * fps < layout.frames - 0.5:
            found.append(Event(min(max(time, 0.0), (layout.frames - 1) / fps), *meaning))
    return tuple(sorted(found, key=lambda event: event.time))


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
