"""A population of adults: bodies, comfortable speeds and walk ratios, drawn from published distributions.

- Stature: US soldiers, 4,082 men and 1,986 women (ANSUR II: Gordon et al. 2014, NATICK/TR-15/007).
- Proportions: sitting height, biacromial and bicristal breadth relative to stature, from the same survey. Averages are
  those of the model that walks; men and women differ from them in opposite directions.
- Comfortable speed: adults under 70 in Bohannon & Williams Andrews 2011 (23,111 people; men of 40-49 1.43 m/s).
- Walk ratio, step length over cadence: 0.0055 m/(steps/min) in daily life (Obuchi et al. 2020, not checked again); it
  grows with stature (Sekiya & Nagasaki 1998), and in people also below 1.03 m/s (Murakami & Otaka 2017), not in ours.
"""

from dataclasses import dataclass

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES, limb_radii
from motionenv.types import Skeleton

#: Stature [m] of men and women: means and standard deviations.
_STATURE = ((1.756, 0.069), (1.629, 0.064))
#: Relative to the average body: means of men and women, and standard deviation. Legs from stature less sitting height,
#: 0.477 and 0.473 of stature ± 0.014; shoulders 0.237 and 0.224 ± 0.010; hips 0.157 and 0.168 ± 0.010.
_LEGS, _SHOULDERS, _HIPS = ((1.004, 0.996), 0.028), ((1.028, 0.972), 0.042), ((0.966, 1.034), 0.06)
#: Comfortable speed [m/s].
_PACE = (1.32, 0.17)
#: Walk ratio [m/(steps/min)] per metre of stature, and the standard deviation of its logarithm at equal stature.
_WALK_RATIO = (0.00332, 0.055)
_MOST = 2.5  # standard deviations from the mean at which draws end
_MEAN_HEIGHT = 0.5 * (_STATURE[0][0] + _STATURE[1][0])
_ADULT = (1.5, 1.95)  # [m]

_LEFT_RIGHT = {joint: [NODES.index(f"{side}_{joint}") for side in ("left", "right")] for joint in (
    "hip", "knee", "ankle", "shoulder")}  # fmt: skip
_UPPER = [NODES.index(name) for name in ("left_shoulder", "right_shoulder", "sternum", "neck", "head")]


@dataclass(frozen=True, repr=False)
class Person(OneLine):
    """A body and how it likes to walk.

    Attributes:
        height: stature [m].
        legs: length of the legs relative to stature, as a share of the average body's; the trunk is the rest.
        shoulders, hips: breadth between them relative to stature, likewise.
        speed: comfortable walking speed [m/s].
        walk_ratio: step length over cadence [m/(steps/min)].
    """

    height: float
    legs: float
    shoulders: float
    hips: float
    speed: float
    walk_ratio: float

    @property
    def step_length(self) -> float:
        """At the comfortable speed [m]."""
        return float(np.sqrt(60 * self.walk_ratio * self.speed))

    def body(self, proportions: np.ndarray, height: float | None = None) -> Skeleton:
        """The person's body, scaled to `height` [m], None is the person's own.

        `proportions` (16, 3) are the offsets of the average body's nodes in body heights.
        """
        height, offsets = self.height if height is None else height, proportions.copy()
        leg = -offsets[[_LEFT_RIGHT["knee"][0], _LEFT_RIGHT["ankle"][0]], 2].sum()
        offsets[_LEFT_RIGHT["knee"] + _LEFT_RIGHT["ankle"]] *= self.legs
        offsets[_UPPER, 2] *= 1 - (self.legs - 1) * leg / (1 - leg - ANKLE_HEIGHT)
        offsets[_LEFT_RIGHT["shoulder"], 1] *= self.shoulders
        offsets[_LEFT_RIGHT["hip"], 1] *= self.hips
        return Skeleton(offsets * height, limb_radii(height), height)


def average_person(height: float) -> Person:
    """Who has average proportions, pace and walk ratio at that `height` [m]: one of those that `draw_person` draws."""
    return Person(height, 1.0, 1.0, 1.0, float(np.sqrt(_size(height)) * _PACE[0]), _WALK_RATIO[0] * height)


def draw_person(rng: np.random.Generator, *, height: float | None = None, about: float = _MEAN_HEIGHT) -> Person:
    """Draw an adult, man or woman.

    Args:
        rng: random generator.
        height: stature [m]; None draws it.
        about: mean stature [m] of the people that a model learned from. If it isn't that of adults, people are scaled
            to it, and their speed with the square root of it (Hof 1996).
    """
    sex = int(rng.integers(2))
    z = np.clip(rng.standard_normal(6), -_MOST, _MOST)
    size = _size(about)
    mean, deviation = _STATURE[sex]
    stature = size * (mean + deviation * z[0]) if height is None else height
    legs, shoulders, hips = (of[0][sex] + of[1] * d for of, d in zip((_LEGS, _SHOULDERS, _HIPS), z[1:4], strict=True))
    speed = np.sqrt(size) * (_PACE[0] + _PACE[1] * z[4])
    ratio = _WALK_RATIO[0] * stature * np.exp(_WALK_RATIO[1] * z[5])
    return Person(*(float(value) for value in (stature, legs, shoulders, hips, speed, ratio)))


def _size(height: float) -> float:
    """1 for the height [m] of adults, else how much larger than the average adult's it is."""
    return 1.0 if _ADULT[0] <= height <= _ADULT[1] else height / _MEAN_HEIGHT
