"""Movement Analysis Profile and Gait Profile Score (Baker et al. 2009): how far angles are from a reference."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.gait.bands import PROFILE_ANGLES, Band, differences

_NAN = float("nan")
#: By side, what makes up its score: its nine angles; of both sides together, the pelvis counts once, over left strides.
_PARTS = {side: [f"{side}_{name}" for name in PROFILE_ANGLES] for side in ("left", "right")}
_PARTS[""] = [*_PARTS["left"], *(key for key in _PARTS["right"] if "_pelvis_" not in key)]


@dataclass(frozen=True, repr=False)
class Score(OneLine):
    """A root mean square difference from the reference's mean over the gait cycle [degrees].

    Attributes:
        name: an angle, such as "knee_flexion"; "gait_profile_score" of all angles; "deviation" of the angles that are
            known, if some are not.
        side: "left", "right", or "" for both together.
        value: mean over strides of an angle's; root mean square of those otherwise.
        n: number of strides, the least of several angles.
        angles: how many angles of both sides it is of.
        median, low, high: median and range of the people of the reference, each against the mean of the others; NaN
            if unknown.
    """

    name: str
    side: str
    value: float
    n: int
    angles: int
    median: float
    low: float
    high: float

    def to_dict(self) -> dict:
        """The figures for JSON: None where unknown."""
        return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(self).items()}


def profile_of(curves: Mapping[str, np.ndarray], band: Band) -> tuple[Score, ...]:
    """The profile of one person against the reference `band`: each angle's score by side, then the sides', then both's.

    `curves` are by side the angles of his strides, (strides, 101, 13) [degrees], in the order of `ANGLES`. A stride in
    which an angle is partly unknown doesn't count for this angle. There is no score of both sides from one side alone.
    """
    of_strides = differences(curves, band.mean)
    found = []
    for key, values in of_strides.items():
        side, name = key.split("_", 1)
        found.append(Score(name, side, float(values.mean()), len(values), 1, *_spread(band, [key])))
    for side, parts in _PARTS.items():
        known = [key for key in parts if key in of_strides]
        sides = {key.split("_", 1)[0] for key in known}
        if len(sides) == (1 if side else 2):
            name = "gait_profile_score" if known == parts else "deviation"
            value = float(np.sqrt(np.mean([of_strides[key].mean() ** 2 for key in known])))
            least = min(len(of_strides[key]) for key in known)
            found.append(Score(name, side, value, least, len(known), *_spread(band, known)))
    return tuple(found)


def _spread(band: Band, keys: Sequence[str]) -> tuple[float, float, float]:
    """Median, least and greatest over the reference's people of the same score."""
    if not all(key in band.scores for key in keys):
        return _NAN, _NAN, _NAN
    people = np.sqrt(np.mean([band.scores[key] ** 2 for key in keys], axis=0))
    people = people[np.isfinite(people)]
    return (float(np.median(people)), float(people.min()), float(people.max())) if len(people) else (_NAN, _NAN, _NAN)
