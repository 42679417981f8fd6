"""How walks meet the ground: drawn people of each model beside captured ones, by the same detector of contacts.

    motionenv bench gait_validity.contact [--people 200] [--mocap FOLDER]

The knee's flexion at initial contact; the phase of contact, from when that ankle is furthest ahead of the other
[cycles]; the range of the forward speed of the pelvis within a stride; the slip of the ball of the foot that alone
bears the body, 95 % of strides; and by how much a "straight" walk of 20 s ends beside its direction. Drawn people walk
at their own pace and at those of the bins in which captured people are grouped, each trial of the CMU set by its speed.

A last table says what two harmonics leave, up to the eighth, of the paths of markers of people left out, and what the
others' average walker, in proportion to strides, leaves of that.
"""

import warnings
from collections.abc import Iterator

import numpy as np
from scipy.ndimage import gaussian_filter1d

import motionenv
from benchmarks import Arguments
from benchmarks.gait_validity.__main__ import FPS, KNEES, slips_of, strides_of
from motionenv.body.kinematics import forward
from motionenv.body.skeleton import NODES
from motionenv.errors import ExtrapolationWarning
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import HIGHER, stride_lengths
from motionenv.models.eigenwalkers.table import Table, mean_higher
from motionenv.models.eigenwalkers.table import read_walks as read_table
from motionenv.models.training import Walks, read_walks
from motionenv.types import Motion

SECONDS, LONG = 8.0, 20.0  # [s]
BINS = ((0.5, 0.9), (0.9, 1.2), (1.2, 1.5), (1.5, 1.8))  # [m/s]
_ANKLES = [NODES.index("left_ankle"), NODES.index("right_ankle")]
_SMOOTH = 0.03  # [s] of the speed


def strides(motion: Motion) -> Iterator[tuple[float, float, float, float]]:
    """Knee at contact [degrees], phase of contact [cycles], range of speed [m/s] and speed [m/s] of each stride."""
    fps, clock, way = motion.fps, np.arange(len(motion.poses)), motion.poses[-1, :2] - motion.poses[0, :2]
    along = way / np.linalg.norm(way)
    path = motion.poses[:, :2] @ along
    speed = gaussian_filter1d(np.gradient(path, 1 / fps), _SMOOTH * fps)
    ankles = forward(motion.poses, motion.skeleton)[0][:, _ANKLES, :2] @ along
    for stride in strides_of(motion):
        side = int(stride.side == "right")
        start, end = stride.start * fps, stride.end * fps
        first, last = round(start), round(end)
        if last >= len(clock):
            continue
        lead = ankles[:, side] - ankles[:, 1 - side]
        low = max(0, first - round(0.3 * (end - start)))
        furthest = low + int(lead[low : first + round(0.15 * (end - start))].argmax())
        knee = np.degrees(np.interp(start, clock, motion.poses[:, KNEES[side]]))
        yield (
            float(knee), (start - furthest) / (end - start), float(np.ptp(speed[first : last + 1])),
            (path[last] - path[first]) * fps / (last - first),
        )  # fmt: skip


def of_model(name: str, people: int, speed: float | None) -> tuple[np.ndarray, float, np.ndarray]:
    """Means of people's strides (people, 4), 95 % of slips [m], and where walks of 20 s end [degrees] (people,)."""
    model, rows, slips, veers = motionenv.load(name), [], [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        for seed in range(people):
            motion = model.synthesize(SECONDS, FPS, seed=seed, speed=speed)
            rows.append(np.mean(list(strides(motion)), axis=0))
            slips += slips_of(motion, strides_of(motion))
            way = model.synthesize(LONG, 30, seed=seed, speed=speed).poses[-1, :2]
            veers.append(np.degrees(np.arctan2(way[1], way[0])))
    return np.array(rows), float(np.nanpercentile(slips, 95)), np.array(veers)


def left_by_harmonics(walks: Walks) -> tuple[float, float]:
    """Root mean squares [mm] over people of higher harmonics: as they are, and less those of the others' average."""
    table, who = read_table([fourier_walker(one) for one in walks.markers], walks.subjects), np.array(walks.subjects)
    errors = []
    for person in np.unique(who):
        out = who == person
        others = Table(table.rows[~out], table.frequencies[~out], tuple(who[~out]), table.higher[~out])
        own, strides = table.higher[out], stride_lengths(table.rows[out])[:, None, None, None]
        errors.append([np.nanmean(own**2), np.nanmean((own - strides * mean_higher(others)) ** 2)])
    # Each harmonic has a sine and a cosine, whose squares are half of their amplitudes' over time.
    return tuple(1000 * np.sqrt(len(HIGHER) * np.mean(errors, axis=0)))


def row(label: str, values: np.ndarray, people: str, slip: str, veer: str) -> str:
    """One line of the table."""
    knee, phase, spread, speed = values.mean(axis=0)
    return f"| {label} | {people} | {speed:.2f} | {knee:.1f}° | {phase:+.3f} | {spread:.2f} | {slip} | {veer} |"


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=("cmu_asfamc",))
    parser.add_argument("--people", type=int, default=200, quick=2, help="number of people of each model")
    asked = parser.parse_args()
    walks = read_walks(asked.mocap / "cmu_asfamc", fps=120).straight()
    some = slice(0, 6) if asked.quick else slice(None)
    means = [np.mean(list(strides(motion)), axis=0) for motion in walks.motions[some]]
    slips = [slip for motion in walks.motions[some] for slip in slips_of(motion, strides_of(motion))]
    captured, who = np.array(means), np.array(walks.subjects[some])
    bins = [(captured[:, 3] >= low) & (captured[:, 3] < high) for low, high in BINS]
    print("| walks | people | speed [m/s] | knee at contact | contact | range of speed [m/s] | slip [cm] | veer |")
    print("|-" * 8 + "|")
    print(row("captured", captured, str(len(set(who))), f"{100 * np.nanpercentile(slips, 95):.1f}", ""))
    for inside in bins:
        if inside.any():
            print(row("captured", captured[inside], str(len(set(who[inside]))), "", ""))
    for name in ("walk/fpca", "walk/eigenwalkers", "walk/prior"):
        for speed in (None, *(float(captured[inside, 3].mean()) for inside in bins if inside.any())):
            values, slip, veers = of_model(name, asked.people, speed)
            veer = f"{veers.min():+.1f} to {veers.max():+.1f}°, mean {veers.mean():+.2f}°"
            print(row(name, values, str(asked.people), f"{100 * slip:.1f}", veer))
    two, rest = left_by_harmonics(walks)
    print(f"\n| paths of markers, people left out | rms [mm] |\n|-|-|\n| less two harmonics | {two:.1f} |")
    print(f"| and less the others' higher ones | {rest:.1f} |")


if __name__ == "__main__":
    main()
