"""Conversion of file coordinates to the world: length units, vertical axis, and joint hierarchies."""

import numpy as np

from motionenv._core.validation import is_number
from motionenv.errors import MotionError

#: Metres per unit. "cmu" is the Carnegie Mellon database's: 0.45 units to the inch.
METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45}

_SPELLINGS = {
    "metre": "m", "metres": "m", "meter": "m", "meters": "m",
    "centimetre": "cm", "centimetres": "cm", "centimeter": "cm", "centimeters": "cm",
    "millimetre": "mm", "millimetres": "mm", "millimeter": "mm", "millimeters": "mm",
    "in": "inch", "inches": "inch",
}  # fmt: skip

#: File axes that become the world's x, y, z (forward, left, up): a cyclic permutation, which preserves handedness.
_CYCLES = {"x": [1, 2, 0], "y": [2, 0, 1], "z": [0, 1, 2]}


def metres_per(unit) -> float:
    """Metres per file unit: a name in `METRES` (or a usual spelling), or a number.

    Raises:
        MotionError: neither; lists the names.
    """
    if isinstance(unit, str):
        name = unit.strip().lower()
        name = _SPELLINGS.get(name, name)
        if name in METRES:
            return METRES[name]
    elif is_number(unit) and 0 < unit < np.inf:
        return float(unit)
    raise MotionError(f"unit must be one of {', '.join(METRES)} or the metres per file unit (above 0), got {unit!r}")


def upright(points, up: str) -> np.ndarray:
    """Convert points (..., 3) from a right-handed frame with vertical axis `up` to one with z up.

    "z" is the identity; "y" maps (x, y, z) to (z, x, y), so that +z becomes +x (forward) and +x left; "x" maps it to
    (y, z, x).

    Raises:
        MotionError: `up` is none of x, y, z.
    """
    if up not in _CYCLES:
        raise MotionError(f"up must be 'x', 'y' or 'z', got {up!r}")
    return np.asarray(points)[..., _CYCLES[up]]


def forward(parents, offsets, local) -> tuple[np.ndarray, np.ndarray]:
    """Forward kinematics: positions (frames, J, 3) and rotations (frames, J, 3, 3) of y-up joints in the z-up world.

    Args:
        parents: (J,) index of each joint's parent, -1 for roots; parents come first.
        offsets: (frames, J, 3) joint in its parent's frame (roots: in the file's world).
        local: (frames, J, 3, 3) rotation joint → parent.
    """
    positions, rotations = np.array(offsets, dtype=np.float64), np.array(local, dtype=np.float64)
    for j, p in enumerate(parents):
        if p >= 0:
            positions[:, j] = positions[:, p] + (rotations[:, p] @ positions[:, j, :, None])[..., 0]
            rotations[:, j] = rotations[:, p] @ rotations[:, j]
    cycle = _CYCLES["y"]
    return positions[..., cycle], rotations[..., cycle, :][..., cycle]
