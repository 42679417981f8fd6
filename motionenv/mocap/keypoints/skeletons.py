"""Keypoint definitions of 2D detectors, from `skeletons.toml`: names in file order, and how they become 15 markers."""

import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_choice
from motionenv.body.kinematics import markers
from motionenv.body.limbs import from_height
from motionenv.errors import FormatError
from motionenv.types import MARKERS, POSE

_TABLE = tomllib.loads(files(__package__).joinpath("skeletons.toml").read_text(encoding="utf-8"))
_CLEARER = 0.1  # how much more upright people must be by a rarer definition than by the usual one
_TRACE = 0.05  # score of keypoints that tell definitions apart


@dataclass(frozen=True, repr=False)
class KeypointSet(OneLine):
    """The keypoints of one kind of detector.

    Attributes:
        name: such as "halpe-26".
        keypoints: names in file order; "" for those of hands and face.
        joint_spread: of the joints of limbs, where it isn't that of annotated pictures; see `spread`.
    """

    name: str
    keypoints: tuple[str, ...]
    joint_spread: float | None = None

    def ways(self, marker: str) -> list[dict]:
        """Combinations {"of": {keypoint: weight}, "spread": ...} that give a marker, in order of preference."""
        return [way for way in _TABLE["ways"][marker] if set(way["of"]) <= set(self.keypoints)]

    @property
    def spread(self) -> np.ndarray:
        """Distance (15,) of what `markers` gives from the CMU set's, relative to body height; NaN: no such marker."""
        found = np.array([next((way["spread"] for way in self.ways(name)), np.nan) for name in MARKERS])
        return found if self.joint_spread is None else np.where(["_" in m for m in MARKERS], self.joint_spread, found)

    def markers(self, keypoints: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions (frames, 15, 2) and confidences (frames, 15) of the markers.

        Args:
            keypoints: (frames, n, 3): x, y and score; NaN where unknown.
            least: score from which a keypoint is visible.

        A marker is as sure as the least sure of its keypoints; scores above 1 count as 1. Gaps are NaN and 0.
        """
        at = np.where((keypoints[..., 2:] >= least) & (keypoints[..., 2:] > 0), keypoints, np.nan)
        out = np.full((len(keypoints), len(MARKERS), 3), np.nan)
        for m, marker in enumerate(MARKERS):
            for way in self.ways(marker):
                chosen = at[:, [self.keypoints.index(name) for name in way["of"]]]
                xy = np.einsum("k,tki->ti", list(way["of"].values()), chosen[..., :2])
                made = np.column_stack([xy, chosen[..., 2].min(axis=1)])
                out[:, m] = np.where(np.isnan(out[:, m]).any(axis=-1, keepdims=True), made, out[:, m])
        out[np.isnan(out).any(axis=-1)] = np.nan
        return out[..., :2], np.nan_to_num(np.minimum(out[..., 2], 1.0))

    def feet(self, keypoints: np.ndarray, least: float) -> np.ndarray | None:
        """Left heel and toe and right heel and toe (frames, 4, 2), NaN in gaps, as of `markers`; None without them."""
        names = [f"{side}_{part}" for side in ("left", "right") for part in ("heel", "big_toe")]
        if not set(names) <= set(self.keypoints):
            return None
        at = keypoints[:, [self.keypoints.index(name) for name in names]]
        return np.where((at[..., 2:] >= least) & (at[..., 2:] > 0), at[..., :2], np.nan)


#: The definitions by name.
KEYPOINT_SETS = {
    name: KeypointSet(name, (*row["keypoints"].split(), *[""] * row.get("more", 0)), row.get("joint_spread"))
    for name, row in _TABLE["skeletons"].items()
}


def keypoint_set(path: str | Path, keypoints: np.ndarray, name: str | None = None) -> KeypointSet:
    """The definition `name`, or the one that fits keypoints (frames, n, 3) of a file.

    Where several have n keypoints it is the first in the table, unless with another the markers lie much more as those
    of somebody upright: head above pelvis above knees.

    Raises:
        MotionError: no such name.
        FormatError: no definition with that number of keypoints, or `name` has another number.
    """
    if name is not None:
        checked_choice(name, "format", KEYPOINT_SETS)
    fitting = [k for k in KEYPOINT_SETS.values() if len(k.keypoints) == keypoints.shape[1] and name in (None, k.name)]
    if not fitting:
        known = ", ".join(f"{len(k.keypoints)} ({k.name})" for k in KEYPOINT_SETS.values() if name in (None, k.name))
        raise FormatError(path, f"has {keypoints.shape[1]} keypoints for a person, expected {known}")
    if len(fitting) == 1:
        return fitting[0]
    upright = [_uprightness(known, keypoints) for known in fitting]
    return fitting[int(np.argmax(upright))] if max(upright) > upright[0] + _CLEARER else fitting[0]


def _uprightness(known: KeypointSet, keypoints: np.ndarray) -> float:
    """Correlation of the markers' median heights in the picture with those of a standing body; -1 without markers."""
    y = known.markers(keypoints, _TRACE)[0][..., 1]
    seen = np.isfinite(y).any(axis=0)
    heights = -np.nanmedian(y[:, seen], axis=0)
    if seen.sum() < 3 or np.ptp(heights) == 0:
        return -1.0
    standing = markers(np.zeros(len(POSE)), from_height())[seen, 2]
    return float(np.corrcoef(heights, standing)[0, 1])
