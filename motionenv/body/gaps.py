"""Parts of the body that a motion shows. A capture need not hold a whole body: unknown entries of its poses are NaN.

The torso has no angles of its own, since the root is its frame. In a capture of the lower body the root is that of the
pelvis, and nothing above it was seen; so the torso counts as known only where the neck or an upper arm is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from motionenv.body.limbs import LIMB_SEGMENT, LIMBS
from motionenv.body.skeleton import SEGMENT_PARENT, SEGMENTS
from motionenv.errors import GapError
from motionenv.types import MARKERS, POSE

#: Parts of the body and their entries of the pose vector.
PARTS: dict[str, tuple[int, ...]] = {
    part: tuple(i for i, name in enumerate(POSE) if name.startswith(words))
    for part, words in {
        "root": ("root",), "neck": ("neck",),
        "left arm": ("left_shoulder", "left_elbow"), "right arm": ("right_shoulder", "right_elbow"),
        "left leg": ("left_hip", "left_knee"), "right leg": ("right_hip", "right_knee"),
    }.items()
}  # fmt: skip

#: Per segment of `SEGMENTS`: the entries of the pose vector that turn it relative to its parent. A foot has none.
SEGMENT_ENTRIES = (
    slice(6), slice(6, 9),
    slice(9, 12), slice(12, 13), slice(13, 16), slice(16, 17),
    slice(17, 20), slice(20, 21), slice(21, 24), slice(24, 25),
    slice(0), slice(0),
)  # fmt: skip
_UPPER = [LIMBS.index(name) for name in ("left_trunk", "right_trunk", "left_shoulder", "right_shoulder")]
_ABOVE = [SEGMENTS.index(name) for name in ("head", "left_upper_arm", "right_upper_arm")]
_CARRIER = {"head": "head", "elbow": "upper_arm", "wrist": "forearm", "knee": "thigh", "ankle": "shin"}
_MARKER_SEGMENT = [
    SEGMENTS.index("_".join((*name.split("_")[:-1], _CARRIER[name.split("_")[-1]])))
    if name.split("_")[-1] in _CARRIER
    else 0
    for name in MARKERS
]
_UPPER_MARKERS = [MARKERS.index(name) for name in ("sternum", "left_shoulder", "right_shoulder")]


def missing_parts(poses: ArrayLike) -> tuple[str, ...]:
    """The `PARTS` of which poses (..., 25) never show all entries at once; empty if each is seen whole somewhere."""
    known = np.isfinite(np.asarray(poses, dtype=np.float64).reshape(-1, 25))
    return tuple(part for part, entries in PARTS.items() if not known[:, entries].all(axis=1).any())


def known_limbs(poses: np.ndarray) -> np.ndarray:
    """Mask (..., limbs) of the limbs of `motionenv.body.LIMBS` that poses (..., 25), NaN where unknown, show."""
    segments = known_segments(poses)
    limbs = segments[..., LIMB_SEGMENT]
    limbs[..., _UPPER] &= segments[..., _ABOVE].any(axis=-1, keepdims=True)
    return limbs


def known_markers(poses: np.ndarray) -> np.ndarray:
    """Mask (..., 15) of the markers of `motionenv.types.MARKERS` that poses (..., 25), NaN where unknown, show."""
    segments = known_segments(poses)
    markers = segments[..., _MARKER_SEGMENT]
    markers[..., _UPPER_MARKERS] &= segments[..., _ABOVE].any(axis=-1, keepdims=True)
    return markers


def check_shown(poses: np.ndarray, parts: Iterable[str], purpose: str) -> None:
    """Raise a GapError that names the first of `parts` that poses (..., 25) never show; `purpose` is its subject."""
    if missing := [part for part in missing_parts(poses) if part in parts]:
        raise GapError(
            f"{purpose} needs {listed(missing)}, never shown here: fill the motion first with motionenv.fill, "
            "or --fill on the command line"
        )


def listed(parts: Sequence[str]) -> str:
    """Parts of the body as text: "the neck, the left arm and the right arm"."""
    words = [f"the {part}" for part in parts]
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def known_segments(poses: ArrayLike) -> np.ndarray:
    """Whether the rotation and place of each of `SEGMENTS` in poses (..., 25) is known, (..., 12) bool."""
    known = np.isfinite(np.asarray(poses, dtype=np.float64))
    segments = np.empty((*known.shape[:-1], len(SEGMENTS)), dtype=bool)
    for i, (entries, parent) in enumerate(zip(SEGMENT_ENTRIES, SEGMENT_PARENT, strict=True)):
        segments[..., i] = known[..., entries].all(axis=-1)
        if parent >= 0:
            segments[..., i] &= segments[..., parent]
    return segments
