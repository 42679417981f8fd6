"""Share of the strides that a person would mark in a capture which become strides of a model (`motionenv fit`).

Contacts that a person would mark are found as in `mocap.strides`. A walk that is cut by its period gives all strides
within it; of other captures, a stride counts if one of the same side begins and ends within 0.2 s of it, or if it is a
whole stride of that side between other phases. Captures are taken whole, and cut to one, two and three strides, 0.15 s
before the first contact and after the last. Treadmills are captured ones, and straight walks less their even travel.

    motionenv bench mocap.model_strides [--mocap FOLDER] [--every 4]
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from benchmarks.mocap.strides import row, score, stances, wanted
from motionenv.errors import MotionError
from motionenv.gait import Stride, feet_of
from motionenv.mocap import read, retarget
from motionenv.models.walking.strides import walk_strides
from motionenv.types import Markers, Motion

_CUT = 0.15  # [s] kept before and after
_TURNING = ("26_01", "27_01", "29_01", "46_01")


def groups(mocap: Path) -> dict[str, list[Path]]:
    """Files by what they show."""
    cmu = sorted(mocap.glob("cmu_asfamc/*/*.amc"))
    return {
        "laboratories' C3D": sorted(mocap.glob("btkdata/C3DSamples/PiG/PiG_Motion*.c3d")),
        "laboratories' TRC": sorted(mocap.glob("nimble/grf/*/*/*walk*.trc")) + sorted(mocap.glob("bmc/data/*.trc")),
        "CMU, straight": [path for path in cmu if path.stem not in _TURNING],
        "CMU, turning": [path for path in cmu if path.stem in _TURNING],
        "treadmill": sorted(mocap.glob("nimble/osim/Hamner*/*/trials/*/markers.trc")),
        **{
            f"Bandai-Namco, {kind}": sorted(
                p for p in mocap.glob("bandai_namco/*/data/*.bvh") if p.stem.split("_")[1] == kind
            )
            for kind in ("walk", "walk-turn-left", "walk-turn-right", "run", "dash")
        },
    }


def captured(path: Path) -> Markers | Motion:
    """A capture file."""
    fps, unit = (120.0 if path.suffix == ".amc" else None), ("mm" if path.suffix == ".trc" else None)
    return read(path, fps=fps, unit=unit, override=False)


def in_place(motion: Motion) -> Motion:
    """A straight walk as on a treadmill."""
    poses = motion.poses.copy()
    poses[:, :2] -= np.linspace(0, 1, len(poses))[:, None] * (poses[-1, :2] - poses[0, :2])
    return replace(motion, poses=poses)


def part(capture: Markers | Motion, first: int, last: int) -> Markers | Motion:
    """Frames `first` to before `last`."""
    if isinstance(capture, Motion):
        return replace(capture, poses=capture.poses[first:last])
    return Markers(capture.names, capture.positions[first:last], capture.fps)


def scored(capture: Markers | Motion, motion: Motion, marked: Sequence[Stride]) -> np.ndarray:
    """Numbers of strides marked, of those that models learn from, and of captures left out."""
    try:
        found = walk_strides(motion, capture)
    except MotionError:
        return np.array([len(marked), 0, 1])
    if found.found == "events":
        return np.array([*score(found.strides, marked)[:2], 0])
    learned = len(marked) if found.found == "period" else min(len(found.strides), len(marked))
    return np.array([len(marked), learned, 0])


def scores(capture: Markers | Motion, motion: Motion) -> Iterator[np.ndarray]:
    """Scores of the whole capture, and of its parts of one, two and three strides."""
    feet = feet_of(capture)
    contacts, fps, end = stances(feet), feet.fps, len(feet.pelvis)
    yield scored(capture, motion, wanted(contacts, 0.0, end / fps))
    for many in (1, 2, 3):
        total = np.zeros(3, dtype=int)
        for side, times in contacts.items():
            for a, b in zip(times[::2], times[many::2], strict=False):
                first, last = round((a - _CUT) * fps), round((b + _CUT) * fps)
                if first >= 0 and last <= end and b - a <= 2.2 * many:
                    inside = [t - first / fps for t in times if a <= t <= b]
                    marked = [Stride(side, *pair) for pair in pairwise(inside)]
                    total += scored(part(capture, first, last), part(motion, first, last), marked)
        yield total


def main() -> None:
    """Print the table."""
    arguments = Arguments(__doc__, mocap=("btkdata", "cmu_asfamc", "bandai_namco"))
    arguments.add_argument("--every", type=int, default=1, quick=8, help="file of each group, for a sample")
    given = arguments.parse_args()
    cuts = "".join(f" cut to {n}: strides | learned | left out |" for n in (1, 2, 3))
    print(f"| captures | strides | learned | left out |{cuts}\n|" + "-|" * 13)
    for group, paths in groups(given.mocap).items():
        total = np.zeros((2, 4, 3), dtype=int)
        for path in paths[:: given.every]:
            try:
                capture = captured(path)
                motion = capture if isinstance(capture, Motion) else retarget(capture)
                total[0] += list(scores(capture, motion))
                if group == "CMU, straight":
                    still = in_place(motion)
                    total[1] += list(scores(still, still))
            except MotionError as error:
                print(f"left out {path.name}: {error}")
        print(row(group, *total[0]), flush=True)
        if total[1].any():
            print(row(f"{group}, as on a treadmill", *total[1]), flush=True)


if __name__ == "__main__":
    main()
