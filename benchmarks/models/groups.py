"""The axis between women and men, and between groups drawn at random, in depth-camera walks of 100 people.

    motionenv bench models.groups [--components 10] [--random 5] [--mocap FOLDER]

Each person is left out of model and axis once. Groups drawn at random show what an axis between groups that don't
differ says of itself.
"""

import csv

import numpy as np

from benchmarks import Arguments
from benchmarks.models import kinectgait
from motionenv.models.eigenwalkers.model import Eigenwalkers


def main() -> None:
    """Print the table."""
    options = Arguments(__doc__, mocap=("kinectgait",))
    options.add_argument("--components", type=int, nargs="+", default=[4, 10, 30], quick=[2, 3])
    options.add_argument("--random", type=int, default=5, quick=1, help="number of random groups")
    asked = options.parse_args()
    folder = asked.mocap / "kinectgait"
    walkers, persons, _ = kinectgait.pass_walkers(folder)
    with (folder / "person-data.csv").open() as file:
        sex = {row["Individual"]: row["Gender"] for row in csv.DictReader(file)}
    people = sorted(set(persons))
    groups = {
        name: [who for who in people if sex.get(who) == letter] for name, letter in (("women", "F"), ("men", "M"))
    }
    print("| groups | components | fall right, left out | balanced |\n|-|-|-|-|")
    for n in asked.components:
        _tell("women, men", n, Eigenwalkers(n).fit(walkers, persons, groups=groups).axis_)
    rng = np.random.default_rng(0)
    known = groups["women"] + groups["men"]
    for turn in range(asked.random):
        drawn = rng.permutation(known)
        random = {"these": list(drawn[: len(groups["women"])]), "those": list(drawn[len(groups["women"]) :])}
        n = asked.components[len(asked.components) // 2]
        _tell(f"drawn at random, {turn + 1}", n, Eigenwalkers(n).fit(walkers, persons, groups=random).axis_)


def _tell(name: str, components: int, axis) -> None:
    shares = [right / n for right, n in zip(axis.right, axis.people, strict=True)]
    counts = f"{axis.right[0]} of {axis.people[0]}, {axis.right[1]} of {axis.people[1]}"
    print(f"| {name} | {components} | {counts} | {np.mean(shares):.0%} |", flush=True)


if __name__ == "__main__":
    main()
