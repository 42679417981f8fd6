"""Conversion of file coordinates to the world: length units, vertical axis, and joint hierarchies."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import is_number
from motionenv.errors import FormatError, MotionError

#: Metres per unit. "cmu" is the Carnegie Mellon database's: 0.45 units to the inch.
METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45}

#: Plausible spans [m] of the markers on a person, or on a person's legs.
PEOPLE = (0.5, 2.4)

#: The units in which optical systems write markers.
MARKER_UNITS = ("mm", "cm", "m", "inch")

_SPELLINGS = {
    "metre": "m", "metres": "m", "meter": "m", "meters": "m", "metro": "m", "metros": "m", "mtr": "m", "mtrs": "m",
    "decimetre": "dm", "decimetres": "dm", "decimeter": "dm", "decimeters": "dm",
    "centimetre": "cm", "centimetres": "cm", "centimeter": "cm", "centimeters": "cm", "cms": "cm",
    "millimetre": "mm", "millimetres": "mm", "millimeter": "mm", "millimeters": "mm", "mms": "mm",
    "in": "inch", "inches": "inch",
}  # fmt: skip
_NAMED = {
    "m": "metres", "dm": "decimetres", "cm": "centimetres", "mm": "millimetres", "inch": "inches",
    "cmu": f"CMU's units ({METRES['cmu'] * 1000:.1f} mm)",
}  # fmt: skip
_ALIKE = 0.85  # of the letters of a long spelling, at least, for a misspelt one: "milimeters"
_NEAR = 3.5  # factor from the usual span within which a unit is proposed, for hands, several people, stray points
_LEGS, _SLENDER = 0.6, 1.5  # [m] least height of points on legs, and its least ratio to their length and width
_TALL = 1.7  # [m] usual span of the markers on a person

#: File axes that become the world's x, y, z (forward, left, up): a cyclic permutation, which preserves handedness.
_CYCLES = {"x": [1, 2, 0], "y": [2, 0, 1], "z": [0, 1, 2]}

#: The vertical axes that files may have.
UPS = (*_CYCLES, *(f"-{axis}" for axis in _CYCLES))


def metres_per(unit: str | float) -> float:
    """Metres per file unit: a name in `METRES` (or a usual spelling), or a number, also as text; else a MotionError."""
    if isinstance(unit, str):
        if (metres := file_metres(unit)) is not None:
            return metres
        try:
            metres = float(unit)
        except ValueError:
            metres = np.nan
    else:
        metres = unit if is_number(unit) else np.nan
    if 0 < metres < np.inf:
        return float(metres)
    raise MotionError(f"unit must be one of {', '.join(METRES)} or the metres per file unit (above 0), got {unit!r}")


def file_metres(written: str) -> float | None:
    """Metres per unit from its name in a file, however it is spelt ("MM ", "mm.", "milimeters"); None for no unit."""
    if any(c.isdigit() for c in written):  # such as "0.1 mm"
        return None
    letters = "".join(c for c in written.lower() if c.isalpha())
    name = _SPELLINGS.get(letters, letters)
    if name not in METRES and (alike := get_close_matches(letters, _SPELLINGS, 1, _ALIKE)):
        name = _SPELLINGS[alike[0]]
    return METRES.get(name)


def box(points: ArrayLike) -> np.ndarray:
    """Sides (3,) of the box around the points (frames, points, 3), the median over frames; NaN without points."""
    points = np.asarray(points, dtype=np.float64)
    seen = points[np.isfinite(points).all(-1).any(-1)]
    if not seen.size:
        return np.full(3, np.nan)
    return np.median(np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1), axis=0)


def vertical_axis(points: np.ndarray, default: str) -> str:
    """The axis, "x", "y" or "z", along which upright people extend; `default` where it isn't clear.

    It is clear if the points (frames, points, 3) [m] extend along it at least 0.6 m and 1.5 times as far as along each
    other axis.
    """
    sides = box(points)
    _, second, first = np.sort(sides)
    return "xyz"[sides.argmax()] if first >= max(_SLENDER * second, _LEGS) else default


def unit_proposal(points: np.ndarray, units: Sequence[str] = tuple(METRES)) -> str:
    """Propose a unit, one of `units`, for a file that states none, from the size of the body in it.

    The end of a message; points are (frames, points, 3) [file units], NaN in gaps.
    """
    size = box(points).max()
    if not size > 0:
        return f"pass unit= (--unit), one of {', '.join(METRES)}"
    name = min(units, key=lambda unit: abs(np.log(size * METRES[unit] / _TALL)))
    tall = size * METRES[name]
    if not _TALL / _NEAR <= tall <= _TALL * _NEAR:
        number = f"{_TALL / size:.3g}"
        return (
            f"no usual one fits a person: pass the metres per unit; unit={number} (--unit {number}) makes the points "
            f"span {_TALL} m"
        )
    fit = "fits" if PEOPLE[0] <= tall <= PEOPLE[1] else "is nearest to"
    return (
        f"in {_NAMED.get(name, name)} the points would span {tall:.2f} m, which {fit} a person: "
        f'pass unit="{name}" (--unit {name})'
    )


def stated_metres(
    path: str | Path, written: str, points: np.ndarray, unit: str | float | None, override: bool, place: str
) -> float:
    """Metres per unit of markers: a caller's `unit` if it overrides or what is `written` at `place` is none."""
    stated = file_metres(written)
    if unit is not None and (override or stated is None):
        return metres_per(unit)
    if stated is None:
        what = f"the unit of length {written!r} is unknown" if written else "the unit of length is missing"
        raise FormatError(path, f"{what}; {unit_proposal(points, MARKER_UNITS)}", place)
    return stated


def upright(points: ArrayLike, up: str) -> np.ndarray:
    """Convert points (..., 3) from a right-handed frame with vertical axis `up` to one with z up.

    "z" is the identity; "y" maps (x, y, z) to (z, x, y), so that +z becomes +x (forward) and +x left; "x" maps it to
    (y, z, x). With "-z", "-y" or "-x", for axes that point downwards, the second and third of these are negated.

    Raises:
        MotionError: `up` is none of them.
    """
    cycle, signs = _axes(up)
    return np.asarray(points)[..., cycle] * signs


def _axes(up: str) -> tuple[list[int], np.ndarray]:
    """The file's axes that become the world's, and their signs (3,)."""
    sign = -1.0 if checked_up(up).startswith("-") else 1.0
    return _CYCLES[up[-1]], np.array([1.0, sign, sign])


def checked_up(up: str) -> str:
    """A vertical axis `up`; a MotionError unless it is x, y or z, or one of these with a minus."""
    if up not in UPS:
        raise MotionError(f"up must be {', '.join(UPS[:-1])} or {UPS[-1]}, got {up!r}")
    return up


def forward(
    parents: Sequence[int], offsets: np.ndarray, local: np.ndarray, up: str = "y"
) -> tuple[np.ndarray, np.ndarray]:
    """Forward kinematics: positions (frames, J, 3) and rotations (frames, J, 3, 3) of y-up joints in the z-up world.

    Args:
        parents: (J,) index of each joint's parent, -1 for roots; parents come first.
        offsets: (frames, J, 3) joint in its parent's frame (roots: in the file's world).
        local: (frames, J, 3, 3) rotation joint → parent.
        up: the file's world's vertical axis; the joints' own frames are y up in the rest pose.
    """
    positions, rotations = np.array(offsets, dtype=np.float64), np.array(local, dtype=np.float64)
    for j, p in enumerate(parents):
        if p >= 0:
            positions[:, j] = positions[:, p] + (rotations[:, p] @ positions[:, j, :, None])[..., 0]
            rotations[:, j] = rotations[:, p] @ rotations[:, j]
    cycle, signs = _axes(up)
    return positions[..., cycle] * signs, (rotations[..., cycle, :] * signs[:, None])[..., _CYCLES["y"]]
