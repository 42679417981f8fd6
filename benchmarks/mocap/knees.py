"""Knees and hips of CMU's walkers with their skeletons' legs as stored and as corrected, and of markers.

motionenv bench mocap.knees [--mocap FOLDER]
"""

from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from motionenv.gait import Trial, analyse, normalised
from motionenv.gait.strides import mean_and_sd
from motionenv.mocap import person_label, read, retarget
from motionenv.mocap.retargeting import find_nodes
from motionenv.models.walking.preprocessing import STRAIGHT, straightness
from motionenv.types import MARKERS, Markers

#: Walks with markers for comparison: trials of CMU, and whole bodies with Plug-in Gait's markers.
_MARKED = {
    "02_01, its markers": "cmu_c3d/02_01.c3d",
    "06_01, its markers": "nimble/c3d/cmu_dribble_shoot_basketball.c3d",
    "Plug-in Gait": "btkdata/C3DSamples/PiG/PiG_Motion-FlatFoot-Full.c3d",
}
_WAIST = ("LFWT", "RFWT", "LBWT", "RBWT")


def shape(trial: Trial) -> np.ndarray:
    """Flexion (5,) [degrees] of the mean curve of both sides, NaN without strides.

    The knee's at initial contact, greatest in loading, least in terminal stance, greatest in swing; the hip's range.
    """
    curves = []
    for side in ("left", "right"):
        strides = [stride for stride in trial.strides if stride.side == side]
        angles = np.column_stack([trial.angles[f"{side}_{joint}_flexion"] for joint in ("knee", "hip")])
        curves.append(normalised(angles, trial.angles.fps, strides))
    knee, hip = mean_and_sd(np.concatenate(curves))[0].T
    return np.array([knee[0], knee[5:30].max(), knee[25:60].min(), knee[55:95].max(), np.ptp(hip)])


def bob(markers: Markers, height: np.ndarray) -> float:
    """Range [cm] of a height (frames,) [m] in windows of half a second, mean over a capture."""
    window = round(markers.fps / 2)
    return 100 * float(np.mean([np.ptp(height[i : i + window]) for i in range(0, len(height) - window, window // 2)]))


def cmu(mocap: Path, stored: bool) -> np.ndarray:
    """`shape` (people, 5) of CMU's walkers, the mean over each person's trials.

    Args:
        mocap: folder of motion capture.
        stored: whether legs are as stored.
    """
    people = defaultdict(list)
    for path in sorted((mocap / "cmu_asfamc").rglob("*.amc")):
        markers = read(path, fps=120)
        # Without rotations a skeleton's legs can't be corrected.
        motion = retarget(replace(markers, rotations=None) if stored else markers)
        found = shape(analyse(motion))
        if straightness(motion) > STRAIGHT and np.isfinite(found).all():
            people[person_label(path)].append(found)
    return np.array([np.mean(shapes, axis=0) for shapes in people.values()])


def main() -> None:
    """Print both tables."""
    mocap = Arguments(__doc__, mocap=("cmu_asfamc", "btkdata")).parse_args().mocap
    print("| | contact | loading | terminal stance | swing | hip range |\n|-|-|-|-|-|-|")
    for name, stored in (("CMU, as stored", True), ("CMU, corrected", False)):
        shapes = cmu(mocap, stored)
        told = " | ".join(f"{m:.0f} ± {s:.0f}" for m, s in zip(shapes.mean(0), shapes.std(0, ddof=1), strict=True))
        print(f"| {name}, {len(shapes)} people | {told} |", flush=True)
    for name, path in _MARKED.items():
        print(f"| {name} | " + " | ".join(f"{v:.0f}" for v in shape(analyse(read(mocap / path)))) + " |")
    print("\n| rise of the pelvis in a step, cm | markers | skeleton | corrected |\n|-|-|-|-|")
    for trial, path in (("02_01", _MARKED["02_01, its markers"]), ("06_01", _MARKED["06_01, its markers"])):
        marked, skeleton = read(mocap / path), read(mocap / f"cmu_asfamc/{trial[:2]}/{trial}.amc", fps=120)
        waist = np.mean([marked.positions[:, marked.names.index(name), 2] for name in _WAIST], axis=0)
        hips = [find_nodes(m).positions[:, MARKERS.index("pelvis"), 2]
                for m in (replace(skeleton, rotations=None), skeleton)]  # fmt: skip
        print(f"| {trial} | " + " | ".join(f"{bob(skeleton, height):.1f}" for height in (waist, *hips)) + " |")


if __name__ == "__main__":
    main()
