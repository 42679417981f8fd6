"""A population: bodies, comfortable speeds and walk ratios, drawn from published distributions.

- Stature and weight of adults: US residents of 20 to 69 years, with 17 to 40 kg/m² (NHANES 2017-2018); of children of 6
  to 17 years: CDC 2000 growth charts.
- Girths, and breadths of shoulders and pelvis, relative to stature: 507 adults (Heinz et al. 2003, J Stat Educ 11(2)).
  They follow the body mass index by powers, and have a covariance besides. Head and neck: ANSUR II (Gordon et al. 2014,
  NATICK/TR-15/007), children's heads Nellhaus 1968 (not checked again).
- Length of the legs relative to stature: ANSUR II, stature less sitting height. Averages are those of the model that
  walks; women and men differ from them in opposite directions.
- Comfortable speed: adults under 70 in Bohannon & Williams Andrews 2011 (23,111 people; men of 40-49 1.43 m/s).
  Children walk as fast for their size (Hof 1996).
- Walk ratio, step length over cadence: 0.0055 m/(steps/min) in daily life (Obuchi et al. 2020, not checked again); it
  grows with stature (Sekiya & Nagasaki 1998), and in people also below 1.03 m/s (Murakami & Otaka 2017), not in ours.

`motionenv bench gait_validity.anthropometry` makes the table.
"""

import json
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_choice, checked_number
from motionenv.body.limbs import AVERAGE_GIRTHS, GIRTHS, LIMB_SHIFTS, LIMBS, limb_radii
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES
from motionenv.types import PEOPLE, Skeleton

#: The table of published anthropometry.
TABLE = Path(__file__).with_name("anthropometry.json")
#: Least and greatest body mass index of drawn adults, and those that may be asked for [kg/m²].
BMI, ASKED_BMI = (17.0, 40.0), (12.0, 50.0)

_FEMALE, _MALE = 0, 1
_SEX = {"woman": _FEMALE, "girl": _FEMALE, "man": _MALE, "boy": _MALE}
_AGES = (6, 17)
#: Legs relative to the average body's: means of women and men, and standard deviation (stature less sitting height is
#: 0.473 and 0.477 of stature ± 0.014). They are shorter by the second number at six years (sitting height 0.54).
_LEGS, _SHORT_LEGS = ((0.996, 1.004), 0.028), 0.035
#: Circumference of the head [m] of women and men, its deviation, and how much smaller it is at six years. Girth of the
#: neck relative to stature of women and men with 25 kg/m², exponent of the BMI, deviation of the logarithm.
_HEAD, _NECK = ((0.561, 0.574), 0.017, 0.052), ((0.2026, 0.2266), 0.45, 0.04)
#: Weight over stature to this power, and not 2, says how stout a child is: at 1.15 m, a chest measures 0.57 m.
_CHILD_POWER = 2.5
#: How far hair reaches down the neck, relative to the head: least and greatest of women and of men.
_HAIR, _SHORT_HAIR = ((0.05, 0.6), (0.05, 0.2)), 0.12
#: Comfortable speed [m/s].
_PACE = (1.32, 0.17)
#: Walk ratio [m/(steps/min)] per metre of stature, and the standard deviation of its logarithm at equal stature.
_WALK_RATIO = (0.00332, 0.055)
_MOST = 2.5  # standard deviations from the mean at which draws end
_MEAN_HEIGHT, _MEAN_BMI = 1.69, 25.0  # of the average adult
_ADULT = (1.5, 1.95)  # [m]
_CLEAR = 0.6  # of an elbow's radius stays outside of the trunk

_LEFT_RIGHT = {joint: [NODES.index(f"{side}_{joint}") for side in ("left", "right")] for joint in (
    "hip", "knee", "ankle", "shoulder", "elbow")}  # fmt: skip
_UPPER = [NODES.index(name) for name in ("left_shoulder", "right_shoulder", "sternum", "neck", "head")]
_ELBOW = (LIMBS.index("left_upper_arm"), 1)
_WAIST, _HAIR_END = (LIMBS.index("left_trunk"), 0), (LIMBS.index("hair"), 0)
_HALF_TRUNK = LIMB_SHIFTS[(*_WAIST, 1)]
_OUTWARD = np.array([1.0, -1.0])


class _Table(NamedTuple):
    """Published anthropometry; women come before men."""

    names: tuple[str, ...]  # of the m measures
    adults: np.ndarray  # (2, 4) means and deviations of stature [m] and of log BMI [kg/m²]
    at_25: np.ndarray  # (2, m) logarithms of the measures relative to stature at 25 kg/m²
    exponents: np.ndarray  # (m,) of the BMI
    root: np.ndarray  # (m, m) lower Cholesky factor of the residuals' covariance
    height: np.ndarray  # (2, 12, 3) L, M, S of children's stature [m] by age
    bmi: np.ndarray  # (2, 12, 3) and of their BMI [kg/m²]


@cache
def _table() -> _Table:
    read = json.loads(TABLE.read_text())
    girths, children = read["girths"], read["children"]
    return _Table(
        tuple(girths["names"]), np.array(read["adults"]), np.array(girths["at_25"]), np.array(girths["exponents"]),
        np.linalg.cholesky(np.array(girths["covariance"])), np.array(children["height"]), np.array(children["bmi"]),
    )  # fmt: skip


@dataclass(frozen=True, repr=False)
class Person(OneLine):
    """A body and how it likes to walk.

    Attributes:
        height: stature [m].
        legs: length of the legs relative to stature, as a share of the average body's; the trunk is the rest.
        shoulders, hips: breadth between them relative to stature, likewise.
        speed: comfortable walking speed [m/s].
        walk_ratio: step length over cadence [m/(steps/min)].
        bmi: body mass index [kg/m²].
        girths: (12,) relative to stature, in the order of `motionenv.body.limbs.GIRTHS`.
        hair: how far the hair reaches down the neck, relative to the head.
    """

    height: float
    legs: float
    shoulders: float
    hips: float
    speed: float
    walk_ratio: float
    bmi: float = _MEAN_BMI
    girths: tuple[float, ...] = tuple(AVERAGE_GIRTHS.tolist())
    hair: float = _SHORT_HAIR

    def __post_init__(self) -> None:
        object.__setattr__(self, "girths", tuple(self.girths))  # JSON has lists

    @property
    def weight(self) -> float:
        """[kg]."""
        return self.bmi * self.height**2

    @property
    def step_length(self) -> float:
        """At the comfortable speed [m]."""
        return float(np.sqrt(60 * self.walk_ratio * self.speed))

    def weighing(self, weight: float, height: float | None = None) -> "Person":
        """The same person of another `weight` [kg], if of `height` [m], None is the person's own.

        Raises:
            MotionError: a body mass index outside of `ASKED_BMI`.
        """
        height = self.height if height is None else height
        low, high = (bound * height**2 for bound in ASKED_BMI)
        checked_number(weight, f"weight at a height of {height:.2f} m", low, high, "kg")
        bmi = weight / height**2
        girths, broader = _stouter(np.array(self.girths), bmi / self.bmi)
        return replace(self, bmi=bmi, girths=tuple(girths.tolist()), shoulders=self.shoulders * broader)

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
        return self.built(Skeleton(offsets * height, limb_radii(height), height))

    def built(self, body: Skeleton) -> Skeleton:
        """A `body` with the person's girths. Arms hang as far out as a broad trunk asks for."""
        radii = limb_radii(body.height, np.array(self.girths) * body.height)
        radii[_HAIR_END] = self.hair * self.girths[0] * body.height / (2 * np.pi)
        offsets = body.offsets.copy()
        shoulder, elbow = offsets[_LEFT_RIGHT["shoulder"], 1], offsets[_LEFT_RIGHT["elbow"], 2]
        room = radii[_WAIST] + _CLEAR * radii[_ELBOW] + _HALF_TRUNK * body.height - shoulder * _OUTWARD
        out = np.clip(room / -elbow, 0, 0.5)
        offsets[_LEFT_RIGHT["elbow"], 1] = -_OUTWARD * out * elbow
        offsets[_LEFT_RIGHT["elbow"], 2] = elbow * np.sqrt(1 - out**2)
        return Skeleton(offsets, radii, body.height)


def _stouter(girths: np.ndarray, factor: float) -> tuple[np.ndarray, float]:
    """Girths (12,) of somebody whose body mass index is `factor` times as great, and the factor on the shoulders."""
    table = _table()
    exponents = dict(zip(table.names, table.exponents.tolist(), strict=True)) | {"head": 0.0, "neck": _NECK[1]}
    return girths * factor ** np.array([exponents[name] for name in GIRTHS]), factor ** exponents["shoulders"]


def average_person(height: float) -> Person:
    """Who has average proportions, build, pace and walk ratio at that `height` [m]: one of whom `draw_person` draws."""
    return Person(height, 1.0, 1.0, 1.0, float(np.sqrt(_size(height)) * _PACE[0]), _WALK_RATIO[0] * height)


def usual_adult(proportions: np.ndarray) -> Skeleton:
    """The body of the mean adult whom `draw_person` draws, statures ± 6 %; `proportions` as in `Person.body`."""
    adults = _table().adults
    height, bmi = float(adults[:, 0].mean()), float(np.exp(adults[:, 2].mean()))
    return average_person(height).weighing(bmi * height**2).body(proportions)


def draw_person(
    rng: np.random.Generator, *, person: str = "adult", height: float | None = None, about: float = _MEAN_HEIGHT
) -> Person:
    """Draw a person.

    Args:
        rng: random generator.
        person: one of `PEOPLE`.
        height: stature [m]; None draws it.
        about: mean stature [m] of the people that a model learned from. If it isn't that of adults, adults are scaled
            to it, and their speed with the square root of it (Hof 1996).

    Raises:
        MotionError: no such kind of people.
    """
    checked_choice(person, "person", PEOPLE)
    table = _table()
    drawn, age = int(rng.integers(2)), rng.uniform(*_AGES)
    sex, child = _SEX.get(person, drawn), person in ("child", "girl", "boy")
    z = np.clip(rng.standard_normal(7 + len(table.names)), -_MOST, _MOST)
    size = 1.0 if child else _size(about)  # a child is small already
    if child:
        stature, bmi = (_lms(rows[sex], age, d) for rows, d in ((table.height, z[0]), (table.bmi, z[1])))
        young = (18 - age) / 12
    else:
        mean, deviation, log_bmi, spread = table.adults[sex]
        stature, bmi, young = mean + deviation * z[0], np.clip(np.exp(log_bmi + spread * z[1]), *BMI), 0.0
    own, stature = size * stature, size * stature if height is None else height
    stout = bmi * (_MEAN_HEIGHT / own) ** (_CHILD_POWER - 2) if child else bmi
    of = dict(zip(table.names, np.exp(table.at_25[sex] + table.root @ z[7:]), strict=True))
    of["head"] = (_HEAD[0][sex] + _HEAD[1] * z[2] - _HEAD[2] * young) * size / own
    of["neck"] = _NECK[0][sex] * np.exp(_NECK[2] * z[3])
    girths, broader = _stouter(np.array([of[name] for name in GIRTHS]), stout / _MEAN_BMI)
    average = dict(zip(table.names, np.exp(table.at_25).mean(axis=0), strict=True))
    legs = _LEGS[0][sex] + _LEGS[1] * z[4] - _SHORT_LEGS * young
    like = own / _MEAN_HEIGHT if child else size
    speed = np.sqrt(like) * (_PACE[0] + _PACE[1] * z[5])
    ratio = _WALK_RATIO[0] * stature * np.exp(_WALK_RATIO[1] * z[6])
    shoulders, hips = broader * of["shoulders"] / average["shoulders"], of["pelvis"] / average["pelvis"]
    hair = rng.uniform(*_HAIR[sex])
    return Person(
        float(stature), float(legs), float(shoulders), float(hips), float(speed), float(ratio), float(bmi),
        tuple(girths.tolist()), float(hair),
    )  # fmt: skip


def _lms(rows: np.ndarray, age: float, z: float) -> float:
    """The value `z` deviations from the median at an `age` [years], from L, M, S (ages, 3) (Cole & Green 1992)."""
    power, median, spread = (np.interp(age, np.arange(_AGES[0], _AGES[1] + 1), column) for column in rows.T)
    return float(median * (1 + power * spread * z) ** (1 / power))


def _size(height: float) -> float:
    """1 for the height [m] of adults, else how much larger than the average adult's it is."""
    return 1.0 if _ADULT[0] <= height <= _ADULT[1] else height / _MEAN_HEIGHT
