"""Remake `motionenv/gait/cmu_band.json`: joint angles over the gait cycle of the people of the shipped models.

motionenv bench mocap.band [--out FILE]
"""

from collections import defaultdict
from pathlib import Path

from benchmarks import ROOT, Arguments, scratch
from motionenv.gait import Band, Trial, analyse, band_of
from motionenv.models.training import read_walks


def made(mocap: Path) -> Band:
    """The band of the walks that the shipped models learn from.

    Args:
        mocap: folder of motion capture with `cmu_asfamc`.
    """
    walks = read_walks(mocap / "cmu_asfamc", fps=120).straight()
    people: dict[str, list[Trial]] = defaultdict(list)
    for motion, person in zip(walks.motions, walks.subjects, strict=True):
        trial = analyse(motion)
        if any(stride.kind == "steady" for stride in trial.strides):
            people[person].append(trial)
    who = (
        f"{len(people)} people of the CMU Graphics Lab Motion Capture Database, those of the shipped models, who "
        "walked 3 to 5 m at their own pace. Their angles are those of CMU's skeletons with corrected legs "
        "(motionenv/mocap/clinical/skeleton_legs.py), and the trunk stands for the pelvis: compare shapes before "
        "offsets."
    )
    return band_of(people, who)


def main() -> None:
    """Write the band."""
    parser = Arguments(__doc__, mocap=("cmu_asfamc",))
    shipped = ROOT / "motionenv" / "gait" / "cmu_band.json"
    parser.add_argument("--out", type=Path, default=shipped, quick=scratch() / shipped.name, help="file to write")
    chosen = parser.parse_args()
    band = made(chosen.mocap)
    band.save(chosen.out)
    print(f"{chosen.out.name}: {band.who}")


if __name__ == "__main__":
    main()
