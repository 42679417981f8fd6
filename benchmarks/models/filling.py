"""Filling what a capture doesn't show, of people whose walks no shipped model has seen.

    motionenv bench models.filling [--mocap FOLDER]

Arms: neck and both arms are hidden throughout, and the error is over the arms' eight angles. Leg: each leg in turn.
Knee: one knee for 0.2 s or 0.5 s, at five times of the trial. The alternatives are the model's mean posture, paper A's
imputation of cycles by the shipped functional PCA (which needs a straight walk of two cycles), and a cubic spline in
time. The constants of `motionenv.models.filling` were chosen on other trials: CMU's and Bandai-Namco's second set.
"""

import numpy as np
from scipy.interpolate import CubicSpline

import motionenv
from benchmarks import Arguments
from motionenv import Motion
from motionenv.cycles import Alignment, to_reference
from motionenv.errors import MotionError
from motionenv.mocap import read_motion
from motionenv.models.filling import fill
from motionenv.models.filling.prior import prior_of
from motionenv.models.walking.preprocessing import CHANNELS, find_cycles, gait_channels

_PIG, _BANDAI = "btkdata/C3DSamples/PiG/", "bandai_namco/Bandai-Namco-Research-Motiondataset-1/data/"
TRIALS = {
    "Plug-in Gait Full": (_PIG + "PiG_Motion-FlatFoot-Full.c3d", None),
    "Plug-in Gait Hole": (_PIG + "PiG_Motion-FlatFoot-Hole.c3d", None),
    "Plug-in Gait One": (_PIG + "PiG_Motion-FlatFoot-One.c3d", None),
    "Bandai-Namco walk": (_BANDAI + "dataset-1_walk_normal_001.bvh", "cm"),
    "walk-left": (_BANDAI + "dataset-1_walk-left_normal_001.bvh", "cm"),
    "walk-right": (_BANDAI + "dataset-1_walk-right_normal_001.bvh", "cm"),
    "walk-back": (_BANDAI + "dataset-1_walk-back_normal_001.bvh", "cm"),
    "CMU 02_05, punches": ("nimble/c3d/cmu_02_05.c3d", None),
}
_UPPER, _ARMS, _LEGS, _KNEE = range(6, 17), range(9, 17), (range(17, 21), range(21, 25)), 20
_TIMES = 5


def hidden(motion: Motion, entries, frames=slice(None)) -> Motion:
    """The motion without some entries of the pose."""
    poses = motion.poses.copy()
    poses[frames, list(entries)] = np.nan
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


def error(found: np.ndarray, truth: np.ndarray, entries) -> float:
    """Root mean square difference [degrees] of angles, where known."""
    difference = (found - truth)[:, list(entries)]
    return float(np.degrees(np.sqrt(np.nanmean(((difference + np.pi) % (2 * np.pi) - np.pi) ** 2))))


def by_cycles(motion: Motion) -> np.ndarray:
    """Poses whose angles are paper A's imputation of the motion's cycles by the shipped model.

    Raises:
        MotionError: no period, or cycles that show too little.
    """
    found, channels = find_cycles(motion), gait_channels(motion)
    period = found.seconds * motion.fps
    place = np.arange(len(channels)) - found.starts[0] * motion.fps
    alignment = Alignment(np.array([period]), np.array([np.mod(-place[0], period)]), np.zeros((10, 19)), np.zeros(0))
    cycles = to_reference([channels], alignment, [motion.fps], channels=CHANNELS)
    place = (np.arange(len(channels)) - alignment.offsets[0]) / period
    number = np.floor(place).astype(int)
    if len(np.unique(number)) != len(cycles.values):
        raise MotionError("a cycle shows too little")
    whole = motionenv.load("walk/fpca").fpca_.impute(cycles.values)
    poses = motion.poses.copy()
    for k, cycle in zip(np.unique(number), whole, strict=True):
        rows = number == k
        phase = np.arange(len(cycle)) / len(cycle)
        for i in range(19):
            poses[rows, 6 + i] = np.interp(place[rows] - k, phase, cycle[:, i], period=1.0)
    return poses


def knees(motion: Motion, seconds: float) -> tuple[float, float]:
    """Mean errors [degrees] of the left knee in gaps: filled, and by a cubic spline."""
    length, t = round(seconds * motion.fps), np.arange(len(motion.poses))
    errors = []
    for first in np.linspace(length, len(t) - 2 * length, _TIMES).astype(int):
        gap = slice(first, first + length)
        missing = hidden(motion, [_KNEE], gap)
        known = np.isfinite(missing.poses[:, _KNEE])
        spline = missing.poses.copy()
        spline[gap, _KNEE] = CubicSpline(t[known], missing.poses[known, _KNEE])(t[gap])
        errors.append([error(p[gap], motion.poses[gap], [_KNEE]) for p in (fill(missing).poses, spline)])
    return tuple(np.mean(errors, axis=0))


def row(motion: Motion) -> list[str]:
    """Cells of the table for one trial."""
    truth, mean = motion.poses, np.tile(np.r_[np.zeros(6), prior_of("walk/fpca").mean], (len(motion.poses), 1))
    lower = hidden(motion, _UPPER)
    try:
        cycles = f"{error(by_cycles(lower), truth, _ARMS):.1f}"
    except MotionError:
        cycles = "-"
    legs = [(error(fill(hidden(motion, leg)).poses, truth, leg), error(mean, truth, leg)) for leg in _LEGS]
    found = fill(lower).poses
    known = np.isfinite(truth[:, [9, 13]]).all(axis=1) & np.isfinite(found[:, 0])
    swing = np.mean([np.corrcoef(found[known, i], truth[known, i])[0, 1] for i in (9, 13)])
    size = np.mean([found[known, i].std() / truth[known, i].std() for i in (9, 13)])
    return [
        f"{error(found, truth, _ARMS):.1f}", f"{error(fill(lower, model='walk/prior').poses, truth, _ARMS):.1f}",
        f"{error(mean, truth, _ARMS):.1f}", cycles, f"{swing:.2f}", f"{size:.2f}",
        *("{:.1f} / {:.1f}".format(*pair) for pair in (np.mean(legs, axis=0), knees(motion, 0.2), knees(motion, 0.5))),
    ]  # fmt: skip


def main() -> None:
    """Print the table."""
    folder = Arguments(__doc__, mocap=("btkdata", "bandai_namco", "nimble")).parse_args().mocap
    print("| trial | arms: filled | by walk/prior | mean posture | cycles | swing's correlation | its size "
          "| leg: filled / mean | knee, 0.2 s: filled / spline | knee, 0.5 s |")  # fmt: skip
    print("|-" * 10 + "|")
    for name, (path, unit) in TRIALS.items():
        print("| " + " | ".join([name, *row(read_motion(folder / path, unit=unit))]) + " |")


if __name__ == "__main__":
    main()
