"""Which joints a picture shows."""

import numpy as np

from motionenv.body import LIMBS
from motionenv.types import MARKERS

#: Values of visibility, as in COCO.
OUTSIDE, HIDDEN, SEEN = 0, 1, 2

# Limbs that meet at a joint, and so don't hide it; {} is the joint's side.
_MEET = {
    "head": ("head", "neck"), "sternum": ("torso", "shoulders", "neck"),
    "pelvis": ("torso", "pelvis", "left_thigh", "right_thigh"), "hip": ("torso", "pelvis", "{}_thigh"),
    "knee": ("{}_thigh", "{}_shin"), "ankle": ("{}_shin", "{}_foot"),
    "shoulder": ("torso", "shoulders", "{}_upper_arm"), "elbow": ("{}_upper_arm", "{}_forearm"),
    "wrist": ("{}_forearm", "{}_hand"),
}  # fmt: skip
_MEETS = np.zeros((len(MARKERS), 1 + len(LIMBS)), bool)  # at joints (rows), the limbs with these ids
for _row, _name in zip(_MEETS, MARKERS, strict=True):
    _side, _, _part = _name.rpartition("_")
    _row[[1 + LIMBS.index(_limb.format(_side)) for _limb in _MEET[_part]]] = True


def visibility(pixels: np.ndarray, depth: np.ndarray, drawn: dict[str, np.ndarray], number: int) -> np.ndarray:
    """Whether joints are outside the picture (0), hidden (1) or seen (2), (n, frames, 15) uint8.

    A joint is seen if its pixel shows one of the limbs that meet there, or nothing nearer than the joint.

    Args:
        pixels: (n, frames, 15, 2) of the joints.
        depth: (n, frames, 15) [m] of the joints; not above 0 is behind the camera.
        drawn: `depth`, `limbs` and `people` (n, frames, height, width) of the pictures.
        number: of the person in `people`.
    """
    rows, columns = drawn["depth"].shape[-2:]
    with np.errstate(invalid="ignore"):
        inside = ((pixels > -0.5) & (pixels < np.array([columns, rows]) - 0.5)).all(-1) & (depth > 0)
    at = np.where(inside[..., None], pixels, 0)
    column, row = np.rint(at[..., 0]).astype(np.intp), np.rint(at[..., 1]).astype(np.intp)
    n, frame = np.ogrid[: len(pixels), : pixels.shape[1]]
    place = n[..., None], frame[..., None], row, column
    own = (drawn["people"][place] == number) & _MEETS[np.arange(len(MARKERS)), drawn["limbs"][place]]
    shown = own | (drawn["depth"][place] >= depth)
    return np.where(inside, np.where(shown, SEEN, HIDDEN), OUTSIDE).astype(np.uint8)
