"""How walks meet the ground: drawn people of each model beside captured ones, by the same detector of contacts.

    motionenv bench gait_validity.contact [--people 200] [--mocap FOLDER]

The knee's flexion at initial contact; the phase of contact, from when that ankle is furthest ahead of the other
[cycles]; the range of the forward speed of the pelvis within a stride; the slip of the ball of the foot that alone
bears the body, 95 % of strides; and by how much a "straight" walk of 20 s ends beside its direction. Drawn people walk
at their own pace and at those of the bins in which captured people are grouped, each trial of the CMU set by its speed.

A second table says how feet roll over at people's own pace, by the feet as they are drawn: the foot's angle to the
ground at contact, toes up; the shares of the stride after which the foot is flat (within 1°) and after which the heel
is 1 cm higher than then; by how much heel and ball slip along while they bear; and how high the heel floats on landing.

A last table says what two harmonics leave, up to the eighth, of the paths of markers of people left out, and what the
others' average walker, in proportion to strides, leaves of that.
"""

import warnings
from collections.abc import Iterable, Iterator

import numpy as np
from scipy.ndimage import gaussian_filter1d

import motionenv
from benchmarks import Arguments
from benchmarks.gait_validity.__main__ import FPS, KNEES, slips_of, strides_of
from motionenv.body.kinematics import forward, limb_segments
from motionenv.body.limbs import LIMBS
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
_FEET = [LIMBS.index("left_foot"), LIMBS.index("right_foot")]
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


def rollover(motion: Motion) -> Iterator[tuple[float, ...]]:
    """Angle of the foot at contact [degrees]; when it is flat, and its heel off [% of stride]; slips and gap [cm]."""
    ends, radii = limb_segments(motion.poses, motion.skeleton)[:, _FEET], motion.skeleton.radii[_FEET]
    for stride in strides_of(motion):
        foot, radius = ends[:, int(stride.side == "right")], radii[int(stride.side == "right")]
        first, last = round(stride.start * motion.fps), round(stride.end * motion.fps)
        if last >= len(foot) or not np.isfinite(stride.toe_off):
            continue
        foot, off = foot[first : last + 1], round(stride.toe_off * motion.fps) - first
        lowest = foot[..., 2] - radius  # heel, ball
        along = foot[:, 1] - foot[:, 0]
        angle = np.degrees(np.arctan2(along[:, 2], np.linalg.norm(along[:, :2], axis=1)))
        flat = int(np.argmax(angle - np.median(angle[off // 4 : off // 2]) < 1.0))
        heel_off = flat + int(np.argmax(lowest[flat:, 0] > lowest[flat, 0] + 0.01))
        landing = slice(max(1, flat // 3), max(flat, 2))
        yield (
            angle[0] - np.median(angle[off // 4 : off // 2]), 100 * flat / (last - first),
            100 * heel_off / (last - first), 100 * np.hypot(*np.ptp(foot[landing, 0, :2], axis=0)),
            100 * np.hypot(*np.ptp(foot[flat : max(int(0.8 * off), flat + 1), 1, :2], axis=0)),
            100 * lowest[landing, 0].max(),
        )  # fmt: skip


def rolling(label: str, motions: Iterable[Motion]) -> str:
    """One line of the table of rollover: means over strides, of slips and gap 95 %."""
    values = np.concatenate([np.array(list(rollover(motion))).reshape(-1, 6) for motion in motions])
    angle, flat, off = values[:, :3].mean(0)
    heel, ball, gap = np.percentile(values[:, 3:], 95, axis=0)
    return f"| {label} | {angle:.0f}° | {flat:.0f} % | {off:.0f} % | {heel:.1f} | {ball:.1f} | {gap:.1f} |"


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
    print("\n| walks | foot at contact | flat after | heel off after | heel slips [cm] | ball slips [cm] | gap [cm] |")
    print("|-" * 7 + "|")
    print(rolling("captured", walks.motions[some]))
    for name in ("walk/fpca", "walk/eigenwalkers", "walk/prior"):
        model = motionenv.load(name)
        print(rolling(name, (model.synthesize(SECONDS, FPS, seed=seed) for seed in range(asked.people))))
    two, rest = left_by_harmonics(walks)
    print(f"\n| paths of markers, people left out | rms [mm] |\n|-|-|\n| less two harmonics | {two:.1f} |")
    print(f"| and less the others' higher ones | {rest:.1f} |")


if __name__ == "__main__":
    main()
