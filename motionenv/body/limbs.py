"""The drawn limbs of the cylinder body: tapered cylinders with round ends, their girths and clothes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.compilation import part
from motionenv._core.validation import checked_number
from motionenv.body.skeleton import NODES, PROPORTIONS, SEGMENTS
from motionenv.errors import MotionError
from motionenv.types import HEIGHT_RANGE, Skeleton

#: Circumferences that make up a build, in the order of arrays of girths.
GIRTHS = (
    "head", "neck", "chest", "waist", "hips", "thigh", "knee", "calf", "ankle", "upper_arm", "forearm", "wrist",
)  # fmt: skip
#: Those of adults, the mean of women and men with a BMI of 25 kg/m², relative to standing height (Heinz et al. 2003,
#: J Stat Educ 11(2); head and neck: ANSUR II, Gordon et al. 2014).
AVERAGE_GIRTHS = np.array([0.336, 0.212, 0.562, 0.470, 0.583, 0.344, 0.217, 0.217, 0.132, 0.189, 0.156, 0.0957])


class _Limb(NamedTuple):
    """A drawn limb from a start to an end: nodes and shifts from them in the segment's frame, in body heights.

    The radius of an end is that of a circle of so many times a girth, or, if that is "height", so much of it. The girth
    of a limb that is `flat` goes around two such circles, so far apart [body heights].
    """

    name: str
    segment: str
    start: str
    start_shift: tuple[float, float, float]
    end: str
    end_shift: tuple[float, float, float]
    start_girth: tuple[str, float]
    end_girth: tuple[str, float]
    flat: float = 0.0

    def mirrored(self) -> _Limb:
        """The right one, of a limb on the left."""
        names = (value.replace("left", "right") for value in (self.name, self.segment, self.start, self.end))
        name, segment, start, end = names
        shifts = ((x, -y, z) for x, y, z in (self.start_shift, self.end_shift))
        return _Limb(name, segment, start, next(shifts), end, next(shifts), *self[6:])


# The trunk is broader than deep: two cones side by side.
_TRUNK = _Limb(
    "left_trunk", "torso", "pelvis", (0, 0.018, 0.080), "neck", (0.002, 0.018, -0.088),
    ("waist", 1), ("chest", 1), 0.036,
)  # fmt: skip
_SHOULDER = _Limb(
    "left_shoulder", "torso", "neck", (-0.010, 0.022, -0.016), "left_shoulder", (0, -0.004, -0.020),
    ("neck", 1.3), ("upper_arm", 1.12),
)  # fmt: skip
_LEFT = (
    _Limb("left_upper_arm", "left_upper_arm", "left_shoulder", (0, 0, -0.020), "left_elbow", (0, 0, 0),
          ("upper_arm", 1.08), ("upper_arm", 0.8)),
    _Limb("left_forearm", "left_forearm", "left_elbow", (0, 0, 0), "left_wrist", (0, 0, 0),
          ("forearm", 1), ("wrist", 1.04)),
    _Limb("left_hand", "left_forearm", "left_wrist", (0, 0, -0.018), "left_wrist", (0, 0, -0.070),
          ("wrist", 1.25), ("wrist", 1)),
    _Limb("left_thigh", "left_thigh", "left_hip", (0, 0, 0), "left_knee", (0, 0, 0), ("thigh", 1), ("knee", 0.97)),
    _Limb("left_shin", "left_shin", "left_knee", (0, 0, 0), "left_ankle", (0, 0, 0), ("calf", 1), ("ankle", 1)),
    _Limb("left_foot", "left_foot", "left_ankle", (-0.018, 0, -0.017), "left_ankle", (0.086, 0, -0.023),
          ("height", 0.022), ("height", 0.016)),
)  # fmt: skip
_ALL = (
    _TRUNK, _TRUNK.mirrored(), _SHOULDER, _SHOULDER.mirrored(),
    _Limb("pelvis", "torso", "left_hip", (-0.006, -0.012, 0.006), "right_hip", (-0.006, 0.012, 0.006),
          ("hips", 0.94), ("hips", 0.94), 0.076),
    _Limb("neck", "head", "neck", (-0.005, 0, -0.010), "head", (-0.006, 0, -0.035), ("neck", 1), ("neck", 1)),
    _Limb("head", "head", "head", (0.011, 0, -0.040), "head", (-0.003, 0, 0.019), ("head", 0.58), ("head", 0.87)),
    *_LEFT, *(limb.mirrored() for limb in _LEFT),
    _Limb("hair", "head", "head", (-0.020, 0, -0.045), "head", (-0.009, 0, 0.024), ("head", 0.12), ("head", 0.9)),
    _Limb("nose", "head", "head", (0.039, 0, 0.006), "head", (0.046, 0, -0.010), ("head", 0.1), ("head", 0.16)),
    # Both ears are the ends of one limb that goes through the head.
    _Limb("ears", "head", "head", (-0.002, 0.0445, -0.003), "head", (-0.002, -0.0445, -0.003),
          ("head", 0.17), ("head", 0.17)),
)  # fmt: skip

#: Names of the drawn limbs; `Frame.limbs` holds 1 + index into this.
LIMBS = tuple(limb.name for limb in _ALL)

#: Per drawn limb: segment, start node, end node, and the local shifts (2, 3) relative to standing height.
LIMB_SEGMENT = np.array([SEGMENTS.index(limb.segment) for limb in _ALL])
LIMB_NODES = np.array([[NODES.index(limb.start), NODES.index(limb.end)] for limb in _ALL])
LIMB_SHIFTS = np.array([[limb.start_shift, limb.end_shift] for limb in _ALL], dtype=np.float64)
_GIRTHS = [(limb.start_girth, limb.end_girth) for limb in _ALL]
_GIRTH = np.array([[(*GIRTHS, "height").index(girth) for girth, _ in ends] for ends in _GIRTHS])
_SHARE = np.array([[share for _, share in ends] for ends in _GIRTHS])
_FLAT = np.array([[limb.flat] for limb in _ALL])
_LEAST_RADIUS = 0.003  # body heights

_HEAD, _SKULL = LIMBS.index("head"), SEGMENTS.index("head")

#: Garment of each drawn limb, in the order of `LIMBS`, and default colours of garments (sRGB, 0 to 1).
CLOTHES = tuple(
    {"head": "skin", "neck": "skin", "hand": "skin", "nose": "skin", "ears": "skin", "pelvis": "trousers",
     "thigh": "trousers", "shin": "trousers", "foot": "shoes", "hair": "hair"}.get(limb.split("_")[-1], "shirt")
    for limb in LIMBS
)  # fmt: skip
COLOURS = {
    "skin": (0.87, 0.67, 0.55), "shirt": (0.22, 0.46, 0.68), "trousers": (0.26, 0.28, 0.35),
    "shoes": (0.16, 0.14, 0.14), "hair": (0.27, 0.19, 0.13),
}  # fmt: skip


def from_height(height: float = 1.75, *, girth: float = 1.0) -> Skeleton:
    """A body of average proportions (Winter 2009, fig. 4.1) and build (`AVERAGE_GIRTHS`).

    Its `height` is 0.5 to 2.5 m standing; `girth`, 0.5 to 2, is a factor on the thickness of all limbs.

    Raises:
        MotionError: `height` or `girth` out of range.
    """
    checked_number(height, "height", *HEIGHT_RANGE)
    return Skeleton(np.array([PROPORTIONS[n] for n in NODES]) * height, limb_radii(height, girth), height)


def limb_radii(height: float, girth: float | ArrayLike = 1.0) -> np.ndarray:
    """Radii (limbs, 2) [m] at the ends of the drawn limbs of a person of `height` [m].

    Args:
        height: standing height [m].
        girth: 0.5 to 2, a factor on all of the average radii; or girths (12,) [m] in the order of `GIRTHS`.

    Raises:
        MotionError: `girth` out of range.
    """
    if np.ndim(girth) == 0:
        checked_number(girth, "girth", 0.5, 2.0)
        return _radii(AVERAGE_GIRTHS * girth) * height
    girths = np.asarray(girth, dtype=np.float64)
    if girths.shape != (len(GIRTHS),) or not (girths > 0).all():
        raise MotionError(f"girth must be one number or {len(GIRTHS)} above 0, got {girth!r}")
    return _radii(girths / height) * height


def _radii(girths: np.ndarray) -> np.ndarray:
    """Radii (limbs, 2) of `girths` (12,), both relative to standing height."""
    around = np.append(girths, 2 * np.pi)[_GIRTH]
    return np.maximum((_SHARE * around - 2 * _FLAT) / (2 * np.pi), _LEAST_RADIUS)


#: Greatest radius of the average head relative to standing height: the head's shifts are those of such a head.
HEAD_RADIUS = float(limb_radii(1.0)[_HEAD, 1])


def current_radii(radii: np.ndarray, height: float) -> np.ndarray:
    """Radii (limbs, 2) [m] of a body of `height` [m] that motionenv 0.3 stored.

    Its 17 limbs had no face, no hair and another shape: they become average ones, as thick as their torso was.
    Other radii are returned as they are.
    """
    if len(radii) != 17:
        return radii
    return limb_radii(height, float(np.clip(radii[0, 0] / (0.062 * height), 0.5, 2.0)))


def resized(body: Skeleton, height: float) -> Skeleton:
    """The same `body`, enlarged to `height` [m]."""
    factor = height / body.height
    return Skeleton(body.offsets * factor, body.radii * factor, height)


def head_size(skeleton: Skeleton) -> float:
    """Body height [m] of whom a `skeleton`'s head would be the average one."""
    return float(skeleton.radii[_HEAD, 1] / HEAD_RADIUS)


def limb_shifts(skeleton: Skeleton) -> np.ndarray:
    """Shifts (limbs, 2, 3) [m] of the ends of a `skeleton`'s drawn limbs from their nodes, in the segments' frames."""
    sizes = np.where(LIMB_SEGMENT == _SKULL, head_size(skeleton), skeleton.height)
    return LIMB_SHIFTS * sizes[:, None, None]


@part
def set_shifts(segment, shifts, radii, height, out):
    """Write `limb_shifts` of a body with `radii` (limbs, 2) [m] and `height` [m] to `out`; `shifts` are `LIMB_SHIFTS`.

    A person's head grows less than the rest: its limbs are shifted as far as its radius says.
    """
    head = radii[_HEAD, 1] / HEAD_RADIUS
    for limb in range(len(segment)):
        size = head if segment[limb] == _SKULL else height
        for end in range(2):
            for axis in range(3):
                out[limb, end, axis] = size * shifts[limb, end, axis]
