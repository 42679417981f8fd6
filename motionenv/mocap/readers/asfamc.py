"""ASF/AMC: Acclaim's skeleton and motion files, as in the Carnegie Mellon database (y up in the file).

A bone's rotation relative to its parent is L = C M C⁻¹ (Lander 1998, "Working with motion capture file formats"): C is
the rotation by the bone's `axis`, M that by its degrees of freedom; each applies the first-named axis first ("XYZ" is
R_z R_y R_x).
"""

from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from motionenv._core.rotations import from_euler
from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError
from motionenv.mocap.readers.text import number, read_lines
from motionenv.mocap.units_axes import checked_up, forward, metres_per
from motionenv.types import Markers

_INCH = 0.0254
_DOF = {"rx", "ry", "rz"}
_ROOT_DOF = _DOF | {"tx", "ty", "tz"}

#: Line number and words of a line.
_Line = tuple[int, list[str]]


@dataclass
class _Bone:
    """A bone. `offset`: vector from its start to its end [file units]; `axis`: C; `dof`: such as ("rx", "rz")."""

    name: str
    offset: list[float]
    axis: np.ndarray
    dof: tuple[str, ...]
    line: int
    parent: int = -1


def read(
    path: str | Path, asf: str | Path | None = None, fps: float | None = None, unit: str | float | None = None,
    up: str | None = None, override: bool = True,
) -> Markers:  # fmt: skip
    """Read the root and the end of every bone. Points are named like their bone: "lfemur" is the left knee.

    (In the CMU database "lradius" ends at two thirds of the forearm, where it twists; "lwrist" is the rest of it.)
    Rotations are those of the bones relative to their rest pose, in the world.

    Args:
        path: the AMC file.
        asf: the ASF file of its skeleton; None uses the one in the same folder. If there are several, it is the one
            named after the subject, the first part of the AMC file's name ("01" of "01_01.amc").
        fps: frame rate, which AMC files don't specify (120 in the CMU database).
        unit, override: as of `motionenv.mocap.read`.
        up: the files' vertical axis, "x", "y" or "z", if not "y".

    Raises:
        FormatError: no fps, no or several skeletons, or malformed ASF or AMC files; names the line.
    """
    if fps is None:
        raise FormatError(path, "AMC files don't specify their frame rate; pass fps= (--fps), 120 for the CMU database")
    fps = checked_fps(fps)
    lines = read_lines(path)
    skeleton = _Asf(_beside(path) if asf is None else asf)
    stated = skeleton.has_length() and not override
    scale = skeleton.metres() if unit is None or stated else metres_per(unit)
    bones = skeleton.bones()
    amc = _Amc(path, bones)
    values = amc.values(lines)
    offsets, local = _locals(bones, _in_degrees(bones, values) if amc.radians else values)
    parents = tuple(b.parent for b in bones)
    positions, rotations = forward(parents, offsets * scale, local, checked_up(up or "y"))
    return Markers(tuple(b.name for b in bones), positions, fps, parents, rotations, Path(path).stem)


def _beside(path) -> Path:
    path = Path(path)
    found = sorted(p for p in path.parent.iterdir() if p.suffix.lower() == ".asf")
    own = (path.stem.lower(), path.stem.split("_")[0].lower())
    chosen = [p for p in found if p.stem.lower() in own] or found
    if len(chosen) != 1:
        have = ", ".join(p.name for p in found) or "none"
        raise FormatError(path, f"needs the ASF file of its skeleton (beside it: {have}); pass asf=")
    return chosen[0]


def _ordered(order: str, degrees) -> np.ndarray:
    """Rotations (..., 3, 3) by angles (..., n) [degrees] about the axes of `order`, the first applied first."""
    return from_euler(order[::-1].upper(), np.radians(degrees)[..., ::-1])


class _Asf:
    def __init__(self, path):
        self.path = path
        self._sections: dict[str, list[_Line]] = {}
        section: list[_Line] = []
        for i, line in enumerate(read_lines(path), 1):
            words = line.partition("#")[0].split()
            if words and words[0].startswith(":"):
                section = self._sections[words[0][1:].lower()] = [(i, words)]
            elif words:
                section.append((i, words))

    def _section(self, name: str) -> list[_Line]:
        if name not in self._sections:
            raise FormatError(self.path, f"has no :{name} section: it is truncated or isn't an ASF file")
        return self._sections[name][1:]

    def _fields(self, lines: list[_Line]) -> dict[str, _Line]:
        return {words[0].lower(): (i, words[1:]) for i, words in lines}

    def _numbers(self, fields: dict[str, _Line], key: str, n: int, where: int) -> list[float]:
        i, words = fields.get(key, (where, []))
        if len(words) < n:
            raise FormatError(self.path, f"{key!r} with {n} values is missing", f"line {i}")
        return [number(self.path, i, word, key) for word in words[:n]]

    def has_length(self) -> bool:
        """Whether the file states its unit of length."""
        return "length" in self._fields(self._section("units"))

    def metres(self) -> float:
        """Metres per file unit: `length` is the number of file units per inch."""
        units = self._fields(self._section("units"))
        if "length" not in units:
            raise FormatError(self.path, "doesn't specify its 'length'; pass unit= (--unit)", ":units")
        (length,) = self._numbers(units, "length", 1, 1)
        if length <= 0:
            raise FormatError(self.path, f"'length' must be above 0, got {length:g}; pass unit= (--unit)", ":units")
        return _INCH / length

    def bones(self) -> list[_Bone]:
        """The root and the bones, parents before children."""
        bones = {b.name: b for b in [self._root(), *self._bonedata()]}
        children = self._children(bones)
        order = ["root"]
        for name in order:
            for child in children.get(name, []):
                bones[child].parent = order.index(name)
                order.append(child)
        if lost := set(bones) - set(order):
            raise FormatError(self.path, f"no chain leads from the root to {', '.join(sorted(lost))}", ":hierarchy")
        return [bones[name] for name in order]

    def _root(self) -> _Bone:
        lines = self._section("root")
        fields, first = self._fields(lines), self._sections["root"][0][0]
        if any(self._numbers(fields, "orientation", 3, first)):
            raise FormatError(self.path, "a root orientation other than 0 0 0 isn't supported", f"line {first}")
        position = self._numbers(fields, "position", 3, first)
        dof = self._dof(fields.get("order", (first, [])), _ROOT_DOF)
        return _Bone("root", position, np.eye(3), dof, first)

    def _bonedata(self) -> list[_Bone]:
        angle = self._fields(self._section("units")).get("angle", (0, ["deg"]))[1]
        turn = np.degrees(1.0) if angle[:1] and angle[0].lower().startswith("rad") else 1.0
        bones: dict[str, _Bone] = {}
        block: list[_Line] | None = None
        for i, words in self._section("bonedata"):
            if words[0].lower() == "begin":
                block = []
            elif words[0].lower() != "end" and block is not None:
                block.append((i, words))
            elif block:
                bone = self._bone(block, turn)
                if bone.name in bones or bone.name == "root":
                    raise FormatError(self.path, f"bone {bone.name!r} occurs twice", f"line {bone.line}")
                bones[bone.name], block = bone, None
            else:
                raise FormatError(self.path, "expected 'begin' of a bone", f"line {i}")
        if block is not None:
            raise FormatError(self.path, "the last bone has no 'end'", ":bonedata")
        return list(bones.values())

    def _bone(self, block: list[_Line], turn: float) -> _Bone:
        fields, first = self._fields(block), block[0][0]
        name = fields.get("name", (first, []))[1]
        if not name:
            raise FormatError(self.path, "a bone has no name", f"line {first}")
        direction = self._numbers(fields, "direction", 3, first)
        (length,) = self._numbers(fields, "length", 1, first)
        angles = np.array(self._numbers(fields, "axis", 3, first)) * turn
        order = fields["axis"][1][3:]
        if len(order) != 1 or sorted(order[0].upper()) != ["X", "Y", "Z"]:
            raise FormatError(self.path, "'axis' needs three angles and their order, e.g. XYZ", f"line {first}")
        dof = self._dof(fields.get("dof", (first, [])), _DOF)
        return _Bone(name[0], [length * d for d in direction], _ordered(order[0], angles), dof, first)

    def _dof(self, line: _Line, allowed: set[str]) -> tuple[str, ...]:
        i, dof = line[0], tuple(word.lower() for word in line[1])
        if not set(dof) <= allowed or len(set(dof)) != len(dof):
            problem = f"degrees of freedom must be among {' '.join(sorted(allowed))}, each once, got {' '.join(dof)}"
            raise FormatError(self.path, problem, f"line {i}")
        return dof

    def _children(self, bones: dict[str, _Bone]) -> dict[str, list[str]]:
        children: dict[str, list[str]] = {}
        placed = {"root"}
        for i, words in self._section("hierarchy"):
            if len(words) == 1 and words[0].lower() in ("begin", "end"):
                continue
            for name in words:
                if name not in bones:
                    raise FormatError(self.path, f"bone {name!r} isn't in :bonedata", f"line {i}")
            if twice := placed.intersection(words[1:]):
                raise FormatError(self.path, f"{', '.join(sorted(twice))} has two parents", f"line {i}")
            placed.update(words[1:])
            children.setdefault(words[0], []).extend(words[1:])
        return children


class _Amc:
    """Reads the frames of a motion file, line by line, into `rows`: the values of all bones in order."""

    def __init__(self, path, bones: list[_Bone]):
        self._path = path
        self._columns, self._width = {}, 0
        for bone in bones:
            self._columns[bone.name] = slice(self._width, self._width + len(bone.dof))
            self._width += len(bone.dof)
        self._moving = {b.name for b in bones if b.dof}
        self._missing: set[str] = set()
        self._last: int | None = None
        self.radians = False
        self.rows: list[list[float]] = []

    def values(self, lines: list[str]) -> np.ndarray:
        """(frames, degrees of freedom) in the file's units and angles."""
        for i, line in enumerate(lines, 1):
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if words[0].startswith(":"):
                self.radians = self.radians or words[0].upper() == ":RADIANS"
            elif len(words) == 1:
                self._begin(i, words[0])
            else:
                self._put(i, words[0], words[1:])
        self._check_whole(len(lines))
        if not self.rows:
            raise FormatError(self._path, "has no frames: it is truncated or isn't an AMC file", f"line {len(lines)}")
        return np.array(self.rows)

    def _begin(self, i: int, word: str):
        self._check_whole(i)
        if not word.isdecimal() or (self._last is not None and int(word) != self._last + 1):
            want = "a frame's number" if self._last is None else f"frame {self._last + 1}"
            raise FormatError(self._path, f"expected {want}, got {word!r}", f"line {i}")
        self._last = int(word)
        self.rows.append([0.0] * self._width)
        self._missing = set(self._moving)

    def _check_whole(self, i: int):
        if self._missing:
            problem = f"frame {self._last} ends without {', '.join(sorted(self._missing))}"
            raise FormatError(self._path, problem, f"line {i}")

    def _put(self, i: int, name: str, words: list[str]):
        if name not in self._missing:
            why = "outside of a frame, or twice in it" if name in self._moving else "that the ASF file doesn't let move"
            raise FormatError(self._path, f"values for {name!r}, {why}", f"line {i}")
        self._missing.remove(name)
        columns = self._columns[name]
        try:
            values = list(map(float, words))
        except ValueError:
            values = [number(self._path, i, word, name) for word in words]
        if len(values) != columns.stop - columns.start or not all(map(isfinite, values)):
            need = columns.stop - columns.start
            raise FormatError(self._path, f"{name!r} needs {need} finite values, got {' '.join(words)}", f"line {i}")
        self.rows[-1][columns] = values


def _in_degrees(bones: list[_Bone], values: np.ndarray) -> np.ndarray:
    turning = np.array([d in _DOF for bone in bones for d in bone.dof])
    return np.where(turning, np.degrees(values), values)


def _locals(bones: list[_Bone], values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (frames, J, 3) [file units] and rotations (frames, J, 3, 3) in the parents' frames; angles in degrees."""
    offsets = np.tile([b.offset for b in bones], (len(values), 1, 1))
    local = np.tile(np.eye(3), (len(values), len(bones), 1, 1))
    at = 0
    for j, bone in enumerate(bones):
        mine = dict(zip(bone.dof, values[:, at : at + len(bone.dof)].T, strict=True))
        at += len(bone.dof)
        turns = [d for d in bone.dof if d in _DOF]
        if turns:
            motion = _ordered("".join(d[1] for d in turns), np.stack([mine[d] for d in turns], axis=-1))
            local[:, j] = bone.axis @ motion @ bone.axis.T
        if bone.parent >= 0:
            offsets[:, j] = (local[:, j] @ offsets[:, j, :, None])[..., 0]
        for i, axis in enumerate("xyz"):
            offsets[:, j, i] += mine.get(f"t{axis}", 0.0)
    return offsets, local
