"""Fourier walkers and eigenwalkers of real people, compared with paper B (Zhang & Troje 2007, section 4.1).

motionenv bench models.eigenwalkers [--mocap FOLDER]
"""

import numpy as np

from benchmarks import Arguments
from benchmarks.captured_walks import cmu_markers
from benchmarks.models import kinectgait
from motionenv.body.kinematics import FOOT_BALL, forward
from motionenv.body.skeleton import NODES, SEGMENTS
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.locomotion import gait
from motionenv.models.eigenwalkers.model import Eigenwalkers

RATES = (0.7, 2.0)  # stride frequencies [Hz] to try if starts and stops are included
COUNTS = (1, 2, 3, 5, 10, 15, 20, 30)
ANKLES = [NODES.index("left_ankle"), NODES.index("right_ankle")]
FEET = [SEGMENTS.index("left_foot"), SEGMENTS.index("right_foot")]


def whole_trial(markers) -> FourierWalker:
    """A walker from a whole trial, with a linear trend removed; `RATES` keep starts from passing as strides."""
    return fourier_walker(markers, frequencies=RATES, steady=0, drift=1)


def skating(motion) -> float:
    """Mean drift [m] per step of the ball of the stance foot, the one that moves forward least."""
    nodes, rotations = forward(motion.poses, motion.skeleton)
    ball = (nodes[:, ANKLES] + rotations[:, FEET] @ (FOOT_BALL * motion.skeleton.height))[..., :2]
    standing = np.gradient(ball[..., 0], axis=0).argmin(axis=1)
    steps = np.split(np.arange(len(ball)), np.flatnonzero(np.diff(standing)) + 1)[1:-1]
    return float(np.mean([np.linalg.norm(np.ptp(ball[s, standing[s[0]]], axis=0)) for s in steps]))


def shares_table(markers, kinect) -> None:
    """Print the shares of variance of the two harmonics, for each way to cut and detrend a walk."""
    rows = [
        ("CMU, whole trials, linear trend", [whole_trial(m) for m in markers]),
        ("CMU, steady stretch, linear trend", [fourier_walker(m, frequencies=RATES, drift=1) for m in markers]),
        ("CMU, steady stretch, cubic trend (default)", [fourier_walker(m) for m in markers]),
        ("kinectgait, depth camera, pieces of 3 s", kinect),
    ]
    print("| share of variance | walks | fundamental, mean | median | second harmonic, mean | median |\n|-|-|-|-|-|-|")
    print("| paper B, treadmill, 80 people | 80 | 91.9 % | | 6.0 % | |")
    for name, walkers in rows:
        shares = np.array([w.shares for w in walkers])
        mean, median = 100 * shares.mean(axis=0), 100 * np.median(shares, axis=0)
        figures = f"{mean[0]:.1f} % | {median[0]:.1f} % | {mean[1]:.1f} % | {median[1]:.1f} %"
        print(f"| {name} | {len(walkers)} | {figures} |")


def components_table(rows) -> None:
    """Print the cumulative shares of variance of the components."""
    print(f"\n| cumulative variance of components | R | {' | '.join(map(str, COUNTS))} |\n|-|-|{'-|' * len(COUNTS)}")
    print(f"| paper B, one column per person | 80 | {' | ' * (len(COUNTS) - 1)}95.5 % |")
    for name, model in rows:
        curve = 100 * np.cumsum(model.explained_variance_ratio_)
        cells = [f"{curve[n - 1]:.1f} %" if n <= len(curve) else "" for n in COUNTS]
        print(f"| {name} | {model.n_people_} | {' | '.join(cells)} |")


def main() -> None:
    """Print the tables."""
    asked = Arguments(__doc__, mocap=("cmu_asfamc", "kinectgait")).parse_args()
    mocap = asked.mocap
    markers, people = cmu_markers(mocap)
    near, persons, pieces = kinectgait.pass_walkers(mocap / "kinectgait")
    shares_table(markers, near)
    walkers = [fourier_walker(m) for m in markers]
    by_person = Eigenwalkers().fit(walkers, people)
    deep = Eigenwalkers().fit(near, persons)
    rows = [("CMU, per person", by_person), ("CMU, per trial", Eigenwalkers().fit(walkers))]
    components_table([*rows, (f"kinectgait, per person ({len(near)} of {pieces} pieces)", deep)])
    pace = np.array([gait(w.coefficients).stride_length * w.frequency / w.speed for w in walkers])
    drift = [skating(by_person.synthesize(4, 120, seed=seed)) for seed in range(2 if asked.quick else 20)]
    print(
        f"\nSpeed by contact over captured speed, {len(pace)} walks: median {np.median(pace):.3f}, "
        f"from {pace.min():.3f} to {pace.max():.3f}.\nSkating of the standing foot per step, {len(drift)} drawn "
        f"walkers: mean {1e3 * np.mean(drift):.1f} mm, most {1e3 * np.max(drift):.1f} mm."
    )


if __name__ == "__main__":
    main()
