"""Initial contacts and toe-offs of a capture: from its file, its force plates, or the paths of the feet."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_choice
from motionenv.errors import MotionError
from motionenv.gait.feet import Feet
from motionenv.gait.kinematic_events import kinematic_events
from motionenv.gait.plate_events import plate_events
from motionenv.types import Event, Recording

#: Where events may come from.
METHODS = ("auto", "file", "plates", "kinematics")
_FEW = 2  # events that say nothing about sides
_SAME = 0.3  # [s] within which two events of a kind and side are the same one: no foot steps again so soon


@dataclass(frozen=True, repr=False)
class Events(OneLine):
    """The gait events of a capture, in the order of time.

    `sources` counts those that came from the "file", from "plates" and from "kinematics"; `notes` are what a reader of
    the `events` should know.
    """

    events: tuple[Event, ...]
    sources: dict[str, int]
    notes: tuple[str, ...] = ()

    def times(self, kind: str, side: str) -> list[float]:
        """Times [s] of the events of a `kind`, "initial_contact" or "toe_off", and a `side`, "left" or "right"."""
        return [event.time for event in self.events if (event.kind, event.side) == (kind, side)]


def find_events(feet: Feet, recording: Recording | None = None, method: str = "auto") -> Events:
    """The initial contacts and toe-offs of a capture, from its `feet` and what the file holds beside its points.

    "auto" believes the file's events first, then its force plates, and takes from the paths of the feet those that
    neither of them has. Events of the file that fit the feet better with left and right exchanged are left out.

    Raises:
        MotionError: `method` isn't one of `METHODS`, or `recording` has nothing for it.
    """
    checked_choice(method, "method", METHODS)
    recording = recording or Recording()
    found = {
        "file": recording.events,
        "plates": plate_events(recording.plates, feet),
        "kinematics": kinematic_events(feet),
    }
    notes: tuple[str, ...] = ()
    if method != "auto":
        found = {method: found[method]}
    elif _exchanged(found["file"], found["kinematics"]):
        found["file"] = ()
        notes = ("the file's events name the wrong sides, so they are left out",)
    kept: list[Event] = []
    sources = {}
    for name, events in found.items():
        new = [event for event in events if not any(_same(event, other) for other in kept)]
        kept += new
        sources[name] = len(new)
    if not kept and method in ("file", "plates"):
        raise MotionError(f"the capture has no events from {method}: use method='auto' or 'kinematics'")
    return Events(tuple(sorted(kept, key=lambda event: event.time)), {k: n for k, n in sources.items() if n}, notes)


def _exchanged(marked: Sequence[Event], seen: Sequence[Event]) -> bool:
    """Whether events fit those seen in the paths of the feet better with left and right exchanged."""
    other = {"left": "right", "right": "left"}
    fits = sum(any(_same(a, b) for b in seen) for a in marked)
    fits_exchanged = sum(any(_same(replace(a, side=other[a.side]), b) for b in seen) for a in marked)
    return fits_exchanged > max(2 * fits, _FEW)


def _same(a: Event, b: Event) -> bool:
    return (a.kind, a.side) == (b.kind, b.side) and abs(a.time - b.time) < _SAME
