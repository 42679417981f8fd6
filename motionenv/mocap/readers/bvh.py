"""BVH: Biovision's hierarchies (Meredith & Maddock 2001, "Motion capture file formats explained").

Joints are y up in the file. A position channel replaces that component of the joint's OFFSET. Rotation channels
multiply in the order in which they stand: "Zrotation Xrotation Yrotation" is R_z R_x R_y. Scale channels, which some
programs add, scale what a joint carries.
"""

from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

import numpy as np

from motionenv._core.rotations import from_euler
from motionenv.errors import FormatError
from motionenv.mocap.readers.text import count, given_fps, number, read_lines, unique
from motionenv.mocap.units_axes import box, checked_up, forward, metres_per, unit_proposal
from motionenv.types import Markers

_CHANNELS = {f"{axis}{kind}" for axis in "xyz" for kind in ("position", "rotation", "scale")}
_SAME = 1e-3  # tolerance of a scale of 1
_PEOPLE = (0.5, 3.0)  # [m] plausible longest side of the bounding box of a person's pose, or of half a person's


@dataclass
class _Joint:
    name: str
    parent: int
    offset: list[float] = field(default_factory=list)
    channels: list[str] = field(default_factory=list)


def read(
    path: str | Path, fps: float | None = None, unit: str | float | None = None, up: str | None = None,
    override: bool = True,
) -> Markers:  # fmt: skip
    """Read the joints of a BVH file; end sites are named "<joint>_end". Rotations are relative to its OFFSETs' pose.

    A file with one frame more or less than "Frames" says, as some programs write, is read with a note.

    Args:
        path: the file.
        fps: frame rate; overrides the file's "Frame Time".
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres, which the format doesn't specify; None assumes
            centimetres, if the first pose then has a usual size.
        up: the file's vertical axis, "x", "y" or "z", if not "y".
        override: whether `fps` replaces what the file states.

    Raises:
        FormatError: a malformed file, or a frame time or a unit that must be given; names the line, and the unit that
            would fit a person.
    """
    lines = read_lines(path)
    start = next((i for i, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if start is None:
        raise FormatError(path, "has no MOTION section: it is truncated or isn't a BVH file", f"line {len(lines)}")
    joints = _Hierarchy(path, lines[:start]).joints
    scale = metres_per("cm" if unit is None else unit)
    frame_time, values, notes = _motion(path, lines, start, sum(len(j.channels) for j in joints))
    parents = [j.parent for j in joints]
    offsets, local = _locals(joints, values)
    positions, rotations = forward(parents, offsets * scale, local, checked_up(up or "y"))
    if unit is None:
        _check_size(path, positions[:1] / scale, scale)
    fps = given_fps(fps, override, lambda: _fps(path, frame_time))
    names = unique(j.name for j in joints)
    return Markers(names, positions, fps, tuple(parents), rotations, Path(path).stem, notes=notes)


class _Hierarchy:
    """Parses the HIERARCHY section, word by word, into `joints`."""

    def __init__(self, path, lines: list[str]):
        self.path = path
        spaced = (line.replace("{", " { ").replace("}", " } ") for line in lines)
        self._words = [(word, i) for i, line in enumerate(spaced, 1) for word in line.split()]
        self._at = 0
        self.joints: list[_Joint] = []
        self._open: list[int] = []
        steps = {
            "ROOT": self._joint, "JOINT": self._joint, "END": self._end,
            "OFFSET": self._offset, "CHANNELS": self._channels, "}": self._close,
        }  # fmt: skip
        if self._next("HIERARCHY").upper() != "HIERARCHY":
            raise self._error("must begin with HIERARCHY: this isn't a BVH file")
        while self._at < len(self._words):
            word = self._next("")
            if word.upper() not in steps:
                raise self._error(f"expected JOINT, End Site, OFFSET, CHANNELS or a brace, got {word!r}")
            steps[word.upper()]()
        if self._open or not self.joints:
            raise self._error("the hierarchy ends with a brace still open" if self._open else "has no ROOT")
        if not any(joint.channels for joint in self.joints):
            raise self._error("has no channels")

    def _error(self, problem: str) -> FormatError:
        line = self._words[self._at - 1][1] if self._at else 1
        return FormatError(self.path, problem, f"line {line}")

    def _next(self, what: str) -> str:
        if self._at >= len(self._words):
            raise self._error(f"the hierarchy ends where {what} should be")
        self._at += 1
        return self._words[self._at - 1][0]

    def _number(self, what: str) -> float:
        word = self._next(what)
        return number(self.path, self._words[self._at - 1][1], word, what)

    def _joint(self):
        words = []
        root = self._words[self._at - 1][0].upper() == "ROOT"
        while (word := self._next("the brace after a joint's name")) != "{":
            words.append(word)
        if not words or root == bool(self._open):
            raise self._error("a joint needs a name; a ROOT must be outside, a JOINT inside of another's braces")
        self._push(" ".join(words))

    def _end(self):
        if self._next("Site").upper() != "SITE" or self._next("a brace") != "{" or not self._open:
            raise self._error("expected 'End Site {' inside of a joint")
        self._push(f"{self.joints[self._open[-1]].name}_end")

    def _push(self, name: str):
        self.joints.append(_Joint(name, self._open[-1] if self._open else -1))
        self._open.append(len(self.joints) - 1)

    def _current(self, what: str) -> _Joint:
        if not self._open:
            raise self._error(f"{what} is outside of every joint")
        return self.joints[self._open[-1]]

    def _offset(self):
        joint = self._current("OFFSET")
        joint.offset = [self._number("OFFSET") for _ in range(3)]

    def _channels(self):
        joint = self._current("CHANNELS")
        n = self._number("the number of channels")
        if n not in range(len(_CHANNELS) + 1) or joint.channels:
            raise self._error(f"joint {joint.name!r} needs one list of 0 to 9 channels")
        joint.channels = [self._next("a channel").lower() for _ in range(int(n))]
        if not set(joint.channels) <= _CHANNELS or len(set(joint.channels)) != n:
            raise self._error(f"joint {joint.name!r} has unknown or repeated channels: {' '.join(joint.channels)}")

    def _close(self):
        if not self._current("'}'").offset:
            raise self._error(f"joint {self.joints[self._open[-1]].name!r} has no OFFSET")
        self._open.pop()


def _check_size(path, pose: np.ndarray, scale: float):
    """Reject joints (1, J, 3) [file units] that are of no person's size if `scale` is metres per unit.

    The root may be the stage's origin.
    """
    pose = pose[:, 1:] if pose.shape[1] > 1 else pose
    size = box(pose).max() * scale
    low, high = _PEOPLE
    if not low <= size <= high:
        problem = f"doesn't say its unit of length, and in centimetres the first pose would be {size:.3g} m long"
        raise FormatError(path, f"{problem}; {unit_proposal(pose)}", "MOTION")


def _motion(path, lines: list[str], start: int, channels: int) -> tuple[str, np.ndarray, tuple[str, ...]]:
    """The frame time as written, the values (frames, channels) of the MOTION section, and a note on their number."""
    head = {}
    for key, i in (("frames", start + 1), ("frame time", start + 2)):
        name, _, value = lines[i].partition(":") if i < len(lines) else ("", "", "")
        if name.strip().lower() != key:
            raise FormatError(path, f"expected {key.title()!r} and a colon", f"line {i + 1}")
        head[key] = value.strip()
    frames = count(path, start + 2, head["frames"], "Frames")
    rows = [(i, words) for i, line in enumerate(lines[start + 3 :], start + 4) if (words := line.split())]
    for i, words in rows:
        if len(words) != channels:
            raise FormatError(path, f"expected {channels} values, one per channel, got {len(words)}", f"line {i}")
    if not rows or abs(len(rows) - frames) > 1:
        raise FormatError(path, f"'Frames' says {frames}, but there are {len(rows)}", f"line {len(lines)}")
    notes = () if len(rows) == frames else (f"'Frames' says {frames}, but there are {len(rows)}: all are read",)
    return head["frame time"], _values(path, rows), notes


def _values(path, rows: list[tuple[int, list[str]]]) -> np.ndarray:
    try:
        values = np.array([list(map(float, words)) for _, words in rows])
        if np.isfinite(values).all():
            return values
    except ValueError:
        pass
    for i, words in rows:
        for word in words:
            number(path, i, word, "a channel's value")
    raise AssertionError("a value was bad before and isn't now")


def _fps(path, frame_time: str) -> float:
    """Frames per second, rounded to a whole number if the digits of the frame time allow it."""
    try:
        written = Decimal(frame_time)
        seconds, half_digit = float(written), 0.5 * 10.0 ** int(written.as_tuple().exponent)
    except (ArithmeticError, ValueError, TypeError):
        seconds = half_digit = np.nan
    if not 1e-6 < seconds < 1e6:
        raise FormatError(path, f"'Frame Time' must be above 0, got {frame_time!r}; pass fps= (--fps)", "MOTION")
    whole = round(1 / seconds)
    return float(whole) if whole and abs(1 / whole - seconds) <= half_digit else 1 / seconds


def _locals(joints: list[_Joint], values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (frames, J, 3) [file units] and rotations (frames, J, 3, 3) of the joints in their parents' frames."""
    frames = len(values)
    offsets = np.tile([j.offset for j in joints], (frames, 1, 1))
    local = np.tile(np.eye(3), (frames, len(joints), 1, 1))
    scales = np.ones((frames, len(joints), 3))
    at = 0
    for j, joint in enumerate(joints):
        mine = values[:, at : at + len(joint.channels)]
        at += len(joint.channels)
        turns = [c.endswith("rotation") for c in joint.channels]
        for channel, value in zip(joint.channels, mine.T, strict=True):
            if channel.endswith("position"):
                offsets[:, j, "xyz".index(channel[0])] = value
            elif channel.endswith("scale"):
                scales[:, j, "xyz".index(channel[0])] = value
        if any(turns):
            order = "".join(c[0].upper() for c, turn in zip(joint.channels, turns, strict=True) if turn)
            local[:, j] = from_euler(order, np.radians(mine[:, turns]))
        if joint.parent >= 0:
            offsets[:, j] *= scales[:, joint.parent]
            scales[:, j] *= scales[:, joint.parent]
    return offsets, local
