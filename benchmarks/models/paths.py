"""Walks along paths: do feet stay where they stand, legs keep their limits, and do walkers turn as people do?

    motionenv bench models.paths [--walkers 100] [--seed 0] [--mocap FOLDER]

Each walker of each model gets a random path (least radius 1.5-5 m), ten seconds long. Half of them walk at an even
speed (0.6-1.9 m/s, at most what takes a lean of 15°), the others stand, start, walk slower and stop.

- slip: a stance is from an initial contact to the next toe-off, as `motionenv.gait` finds them in the paths of heels
  and toes, which knows nothing of how the walk was made. In it, the farthest that the ball of the foot travels while
  it carries weight (15-80 % of the stance: before, only the heel is down, and later the toe leaves), and the farthest
  that the ankle travels while the foot is flat (25-60 %: later, the heel rises). `captured` are straight CMU walks,
  `straight` the models' own walks along x, of the same people at the same speeds.
- straightest knee; lowest pelvis, relative to its median; and the 99.9th percentiles of the legs' angular acceleration
  and of the pelvis', whose path is smoothed over 0.03 s: medians over walks, of captured turns the least and greatest.
- off the path: distance of the pelvis, without its sway (smoothed over 0.45 s), from the path.
- turning, of the made and of captured walks that turn, with curvature from the pelvis' path alone: the whole body's
  inclination (ankles to neck) per v²κ/g, by least squares; by how much the head heads before the pelvis' way does; and
  the stride length of the inner foot over the outer one's where the radius is under 5 m, beside what feet the same
  distance apart would need.

No constant of the library was chosen on these numbers: lean, anticipation and steps follow from the sources that
`motionenv.models.paths.bending` names.
"""

import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.distance import pdist

import motionenv
from benchmarks import Arguments
from benchmarks.captured_walks import straight_trials
from motionenv.body import NODES, feet, forward
from motionenv.errors import ExtrapolationWarning
from motionenv.gait import feet_of, find_events
from motionenv.mocap.readers import asfamc
from motionenv.models.paths import WalkPath, random_path, walk_along

MODELS = ("walk/fpca", "walk/eigenwalkers")
TURNING = ("26_01", "27_01", "29_01", "46_01")
SECONDS, FPS, GRAVITY = 10.0, 60.0, 9.81
RADIUS, SPEED, LEAN = (1.5, 5.0), (0.6, 1.9), np.radians(15.0)
FOREFOOT, FLAT = (0.15, 0.8), (0.25, 0.6)
OVER, BRIEFLY = 0.45, 0.03  # [s]
ROUND = 0.2  # [1/m] of a turn in which inner and outer strides are told apart


def task(rng: np.random.Generator, changing: bool) -> tuple[WalkPath, float, float | list]:
    """A path, the greatest speed on it, and the speed over time."""
    radius = rng.uniform(*RADIUS)
    path = random_path(rng, 40.0, radius=radius, scale=rng.uniform(1.5, 4.0))
    fast = rng.uniform(SPEED[0], min(SPEED[1], np.sqrt(GRAVITY * np.tan(LEAN) * radius)))
    slow = fast * rng.uniform(0.5, 1.0)
    return path, fast, [(0, 0), (1, 0), (2, fast), (4, fast), (5, slow), (8, slow), (9, 0)] if changing else fast


def slips(motion) -> np.ndarray:
    """Farthest ways (stances, 2) [m] of the ball while it is down, and of the ankle while the foot is flat."""
    nodes, balls = feet(motion.poses, motion.skeleton)
    events = find_events(feet_of(motion), method="kinematics")
    found = []
    for side, name in enumerate(("left", "right")):
        offs = events.times("toe_off", name)
        for contact in events.times("initial_contact", name):
            off = next((t for t in offs if t > contact), np.inf)
            if off - contact > 3.0:
                continue
            begins, ends = (
                [int(np.ceil((contact + share * (off - contact)) * motion.fps)) for share in shares]
                for shares in zip(FOREFOOT, FLAT, strict=True)
            )
            ball, ankle = balls[begins[0] : ends[0], side, :2], nodes[begins[1] : ends[1], side, :2]
            if len(ball) > 1 and len(ankle) > 1:
                found.append((pdist(ball).max(), pdist(ankle).max()))
    return np.array(found).reshape(-1, 2)


def hardest(motion) -> tuple[float, float]:
    """99.9th percentiles of the angular accelerations of the legs [rad/s²] and of the pelvis' acceleration [m/s²]."""
    legs = np.abs(np.diff(motion.poses[:, 17:], 2, axis=0)) * motion.fps**2
    root = gaussian_filter1d(motion.poses[:, :3], BRIEFLY * motion.fps, axis=0, mode="nearest")
    pelvis = np.linalg.norm(np.diff(root, 2, axis=0), axis=1) * motion.fps**2
    return float(np.quantile(legs, 0.999)), float(np.quantile(pelvis, 0.999))


def turning(motion) -> dict[str, np.ndarray]:
    """Per frame: v²κ/g and the inclination to the left [rad], headings of way and head [rad]; and strides."""
    smooth = lambda x: gaussian_filter1d(x, OVER * motion.fps, axis=0, mode="nearest")
    nodes, rotations = forward(motion.poses, motion.skeleton)
    at = lambda name: nodes[:, NODES.index(name)]
    velocity = np.gradient(smooth(at("pelvis")[:, :2]), axis=0) * motion.fps
    speed = np.linalg.norm(velocity, axis=-1)
    way = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    rate = np.gradient(way) * motion.fps
    ankles = 0.5 * (at("left_ankle") + at("right_ankle"))
    up = smooth(at("neck") - ankles)
    left = (up[:, :2] * np.column_stack([-velocity[:, 1], velocity[:, 0]])).sum(-1) / np.maximum(speed, 1e-9)
    front = rotations[:, 1, :2, 0]
    head = smooth(np.unwrap(np.arctan2(front[:, 1], front[:, 0])))
    curvature = rate / np.maximum(speed, 0.1)
    walks = speed > 0.4
    walks[: int(motion.fps)] = walks[-int(motion.fps) :] = False  # smoothing has seen nothing beyond the ends
    found = {"needed": speed * rate / GRAVITY, "lean": np.arctan2(left, up[:, 2]), "way": way, "head": head}
    return {name: values[walks] for name, values in found.items()} | {"strides": _strides(motion, curvature, nodes)}


def _strides(motion, curvature, nodes) -> np.ndarray:
    """Rows (length [m], whether it is the inner foot's, curvature [1/m], half the feet's distance [m]) of turns."""
    feet_ = feet_of(motion)
    events, rows = find_events(feet_, method="kinematics"), []
    apart = np.linalg.norm(nodes[:, NODES.index("left_hip")] - nodes[:, NODES.index("right_hip")], axis=-1).mean()
    for name in ("left", "right"):
        times = events.times("initial_contact", name)
        for a, b in pairwise(times):
            i, j = int(a * motion.fps) + 3, min(int(b * motion.fps) + 3, len(nodes) - 1)
            bend = curvature[i:j].mean()
            if abs(bend) > ROUND and b - a < 2.5 and i > motion.fps and j < len(nodes) - motion.fps:
                length = np.linalg.norm(feet_.heel[name][j, :2] - feet_.heel[name][i, :2])
                rows.append((length, (bend > 0) == (name == "left"), abs(bend), 0.5 * apart))
    return np.array(rows).reshape(-1, 4)


def told(found: list[dict]) -> str:
    """Lean, anticipation and stride ratio in words."""
    needed, lean = (np.concatenate([f[name] for f in found]) for name in ("needed", "lean"))
    strides = np.concatenate([f["strides"] for f in found])
    inner, outer = (strides[strides[:, 1] == is_inner] for is_inner in (1, 0))
    lags = np.arange(-30, 31)
    fits = [
        np.corrcoef(*np.concatenate([_rates(f, lag) for f in found if len(f["way"]) > 100], axis=1))[0, 1]
        for lag in lags
    ]
    text = f"lean {needed @ lean / (needed @ needed):.2f} of v²κ/g (r = {np.corrcoef(needed, lean)[0, 1]:.2f}), "
    text += f"head {lags[np.argmax(fits)] / FPS:+.2f} s before the way"
    if len(inner) and len(outer):
        share = strides[:, 2] * strides[:, 3]
        text += f", inner/outer stride {inner[:, 0].mean() / outer[:, 0].mean():.2f}"
        text += f" ({((1 - share) / (1 + share)).mean():.2f} by the hips' distance, {len(strides)} strides)"
    return text


def _rates(found: dict, lag: int) -> np.ndarray:
    """Changes (2, n) of the heading of the head, and of that of the way `lag` frames later."""
    head, way = np.diff(found["head"]), np.diff(found["way"])
    inside = np.arange(30, len(way) - 30)
    return np.stack([head[inside], way[inside + lag]])


def measure(name: str, walkers: int, seed: int) -> None:
    """Print everything of one model."""
    model = motionenv.load(name)
    sets: dict[str, list] = {"straight": [], "even speed": [], "changing speed": []}
    turns, off, legs = [], [], {kind: [] for kind in sets}
    for i in range(walkers):
        rng = np.random.default_rng([seed, i])
        path, fast, speed = task(rng, changing=i % 2 == 1)
        walker = model.walker(rng)
        made = walk_along(model, path, SECONDS, FPS, walker=walker, seed=i, speed=speed)
        kind = "changing speed" if i % 2 else "even speed"
        straight = model.synthesize(SECONDS, FPS, walker=walker, seed=i, speed=fast)
        turns.append(turning(made))
        root = gaussian_filter1d(made.poses[:, :2], OVER * FPS, axis=0, mode="nearest")
        dense = path.position(np.arange(0.0, path.length, 0.01))
        off.append(np.sqrt(((root[:, None] - dense) ** 2).sum(-1).min(axis=1)))
        for which, motion in ((kind, made), ("straight", straight)):
            sets[which].append(slips(motion))
            z = motion.poses[:, 2]
            knees = np.degrees(motion.poses[:, [20, 24]].min())
            legs[which].append((knees, z.min() / np.median(z), *hardest(motion)))
    print(f"{name}, {walkers} walkers")
    for kind, found in sets.items():
        knee, low, leg, pelvis = np.transpose(legs[kind])
        print(f"  {kind:14} {slipped(found)}; straightest knee {knee.min():.1f}°, "
              f"lowest pelvis {low.min():.2f}, leg acceleration {np.median(leg):.0f} rad/s², "
              f"pelvis {np.median(pelvis):.1f} m/s² (at most {pelvis.max():.1f})")  # fmt: skip
    print(f"  off the path: {100 * np.median(np.concatenate(off)):.1f} cm (median), "
          f"{100 * np.percentile(np.concatenate(off), 99):.1f} cm (99 %)")  # fmt: skip
    print(f"  turning: {told(turns)}")


def slipped(found: list[np.ndarray]) -> str:
    """Slips in words."""
    slip = 100 * np.concatenate(found)
    kept, most = 100 * (slip <= 2.0).mean(axis=0), np.percentile(slip, 99, axis=0)
    return (
        f"{len(slip)} stances: ball ≤ 2 cm in {kept[0]:.1f} % (99 %: {most[0]:.1f} cm), flat foot's ankle in "
        f"{kept[1]:.1f} % (99 %: {most[1]:.1f} cm)"
    )


def captured(mocap: Path, turning_trials: tuple[str, ...]) -> None:
    """Print how far captured people's feet slip, and how they turn."""
    trials = straight_trials(mocap)
    walks = [motionenv.retarget(asfamc.read(mocap / "cmu_asfamc" / t[:2] / f"{t}.amc", fps=120)) for t in trials]
    print(f"captured straight walks: {slipped([slips(walk) for walk in walks])}")
    found, hard = [], np.median([hardest(motionenv.types.Motion(w.poses[::2], w.skeleton, FPS)) for w in walks], axis=0)
    print(f"  leg acceleration {hard[0]:.0f} rad/s², pelvis {hard[1]:.1f} m/s²")
    pelvis = []
    for trial in turning_trials:
        motion = motionenv.retarget(asfamc.read(mocap / "cmu_asfamc" / trial[:2] / f"{trial}.amc", fps=120))
        motion = motionenv.types.Motion(motion.poses[::2], motion.skeleton, FPS)
        found.append(turning(motion))
        pelvis.append(hardest(motion)[1])
    print(f"captured ({', '.join(turning_trials)}): {told(found)}, pelvis {min(pelvis):.1f} to {max(pelvis):.1f} m/s²")


def main() -> None:
    """Measure and print."""
    parser = Arguments(__doc__, mocap=True)
    parser.add_argument("--walkers", type=int, default=100, quick=2)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", ExtrapolationWarning)
    for name in MODELS:
        measure(name, arguments.walkers, arguments.seed)
    if arguments.mocap:
        captured(arguments.mocap, TURNING[:1] if arguments.quick else TURNING)


if __name__ == "__main__":
    main()
