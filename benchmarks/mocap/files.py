"""Every C3D and TRC file: whether it is read, becomes motion (of the whole body or part of it) and has strides.

Where a file doesn't state its unit, the one that the refusal proposes is passed, as a user would; such files are marked
with "unit". Files that show no walking person are listed in `NO_WALKER` with the reason.

    motionenv bench mocap.files [--mocap FOLDER]
"""

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from motionenv.errors import MotionError
from motionenv.gait import analyse
from motionenv.mocap import read, retarget
from motionenv.types import Markers

#: Files that show no walking person, by their beginning, and what they show.
NO_WALKER = {
    "btkdata/C3DSamples/PiG/PiG_Calibration": "stands",
    "btkdata/C3DSamples/c3d.org/sample28/standing": "stands",
    "btkdata/C3DSamples/c3d.org/sample20/phasespace_sample": "forty numbered points, which nobody has named",
    "btkdata/C3DSamples/c3d.org/sample21/sample21": "jumps down from a box",
    "btkdata/C3DSamples/c3d.org/sample24/MotionMonitor": "eight electromagnetic sensors",
    "btkdata/C3DSamples/others/Res16bits": "stands",
    "btkdata/C3DSamples/others/parameterOverflow": "angles and moments only: no frame shows any marker",
    "btkdata/TRCSamples/Anto": "arms at a wheelchair",
    "btkdata/TRCSamples/Empty": "empty",
    "btkdata/TRCSamples/Knee": "numbered points, which nobody has named",
    "btkdata/TRCSamples/MOTEK/T.trc": "stands with arms spread",
    "btkdata/TRCSamples/MOTEK/ballet": "ballet",
    "btkdata/TRCSamples/Res16bits": "stands",
    "btkdata/TRCSamples/Truncated": "ends inside its header",
    "btkdata/TRCSamples/UpperLimbStatic": "arms",
    "nimble/c3d/cmu_02_05": "boxes",
    "nimble/c3d/nick_freeform": "moves on the spot",
    "nimble/osim/Return11": "stands",
    "nimble/osim/WeirdFormatTests/markers_Squat2": "squats",
}
_ARMS = slice(6, 17)  # columns of the pose
_UNIT = "unit of length is missing"


@dataclass(frozen=True)
class Outcome:
    """What becomes of one file.

    Attributes:
        motion: "whole", "part", or "" if it is refused.
        strides: in a report.
        unit: whether a unit had to be passed.
        reason: why there is no motion, or no stride.
    """

    motion: str
    strides: int
    unit: bool
    reason: str


def outcome(path: Path) -> Outcome:
    """Read one file, fit the body to it, and analyse its gait."""
    unit = False
    try:
        try:
            markers = read(path)
        except MotionError as error:
            unit = _UNIT in str(error)
            if not unit:
                raise
            markers = read(path, unit="mm", override=False)
        poses = retarget(markers).poses
    except MotionError as error:
        return Outcome("", 0, unit, _short(error, path))
    motion = "whole" if np.isfinite(poses[:, _ARMS]).any() else "part"
    try:
        return Outcome(motion, *_strides(markers, unit))
    except MotionError as error:
        return Outcome(motion, 0, unit, _short(error, path))


def _strides(markers: Markers, unit: bool) -> tuple[int, bool, str]:
    """Number of strides, and why there is none."""
    trial = analyse(markers)
    kinds = ", ".join(f"{s.end - s.start:.1f} s {s.kind}" for s in trial.stretches)
    return len(trial.strides), unit, "" if trial.strides else f"no stride: {kinds}"


def _short(error: MotionError, path: Path) -> str:
    """The first words of a refusal, without the file's own name."""
    text = str(error).replace(f"{path}", path.name).partition(". ")[0]
    return text if len(text) < 160 else f"{text[:160]} …"


def why_no_walker(name: str) -> str | None:
    """What a file shows that shows no walking person; None if it shows one."""
    return next((why for start, why in NO_WALKER.items() if name.startswith(start)), None)


def main() -> None:
    """Print a row per folder, then one for each file that doesn't become motion or has no stride."""
    mocap = Arguments(__doc__, mocap=("btkdata", "nimble")).parse_args().mocap
    files = sorted(p for p in mocap.rglob("*") if p.suffix.lower() in (".c3d", ".trc"))
    found = {p.relative_to(mocap).as_posix(): outcome(p) for p in files}
    folders = defaultdict(list)
    for name in found:
        folders[name.rpartition("/")[0]].append(name)
    print("| folder | files | show a walker | whole body | part of it | refused | with strides |\n|-|-|-|-|-|-|-|")
    total = np.zeros(6, dtype=int)
    for folder, names in folders.items():
        walks = [found[name] for name in names if why_no_walker(name) is None]
        counts = [len(names), len(walks), *(sum(w.motion == m for w in walks) for m in ("whole", "part", ""))]
        counts.append(sum(w.strides > 0 for w in walks))
        total += counts
        print(f"| {folder} | {' | '.join(map(str, counts))} |")
    print(f"| all | {' | '.join(map(str, total))} |")
    others = sum(1 for p in mocap.rglob("*") if p.suffix.lower() in (".bvh", ".amc"))
    print(f"\n{total[2] + total[3]} of {total[1]} C3D and TRC files that show a walking person become motion.")
    print(f"Beside them are {others} BVH and AMC files, whose hierarchies the tests of `tests/mocap` read.")
    print("\n| file | shows | motion | why no motion or no stride |\n|-|-|-|-|")
    for name, one in found.items():
        shows = why_no_walker(name)
        if shows or not one.strides or one.unit:
            motion = (one.motion or "–") + (", unit passed" if one.unit else "")
            print(f"| {name} | {shows or 'a walker'} | {motion} | {one.reason} |")


if __name__ == "__main__":
    main()
