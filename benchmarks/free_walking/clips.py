"""Clips of people who walk, turn, stop, step aside, dance and run, from which the lifting network learns.

    motionenv bench free_walking.clips --count 8000 --seed 1 --out clips.npy [--leave-out 07 16]

Only what may ship is used: CMU's captured walks and dances, gait models fitted to CMU's walks, and runners from
published joint angles. One network must serve people, styles and definitions of joints that no capture here shows, so
every clip is changed in tempo, amplitude, posture, proportions and joint centres, mirrored or played backwards. Half
of the walks are plain, with knees as straight as people's; the others are acted, and differ by more than people do.
"""

import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import motionenv
from benchmarks import Arguments, scratch
from benchmarks.free_walking.running import run
from motionenv.body import markers
from motionenv.body.skeleton import NODES
from motionenv.errors import ExtrapolationWarning, MotionError
from motionenv.lifting.free.posture_network import FRAMES, RATE
from motionenv.mocap import read
from motionenv.mocap.retargeting import retarget
from motionenv.models.paths import bend, random_path
from motionenv.types import MARKERS, POSE, Motion, Skeleton

_LEG = 0.84  # [m] of somebody 1.72 m tall
#: Up to which uniform numbers clips are dances, captured walks, and walks of models; the others are runs.
_DANCED, _CAPTURED, _WALKED = 0.10, 0.46, 0.82
_AT = {name: i for i, name in enumerate(POSE)}
_M = {name: i for i, name in enumerate(MARKERS)}
#: Spread of a person's habitual posture [rad], by part of a pose's name.
_POSTURE = {"root_tilt": 0.10, "neck": 0.15, "shoulder": 0.22, "elbow": 0.30, "hip": 0.08, "knee": 0.06}
_SPREAD = np.array([next((s for part, s in _POSTURE.items() if part in name), 0.0) for name in POSE])
_ARMS = [i for name, i in _AT.items() if "shoulder" in name or "elbow" in name]
_LEGS = [i for name, i in _AT.items() if "hip" in name or "knee" in name]
_KNEES = [i for name, i in _AT.items() if "knee" in name]
_FLEXED = [i for name, i in _AT.items() if name.endswith("hip_flexion")]
#: By how much both knees are bent more than in the captures [rad], mean and deviation, in plain and acted walks. CMU's
#: people bend them by 27 ± 2 degrees on average, those of laboratories by 22 ± 3, 83 of Schwartz et al. (2008) by
#: 24 ± 6, as `gait_validity/norms.csv` has them.
_CROUCH = {"plain": (-0.04, 0.07), "acted": (0.02, 0.13)}
_PLAIN = 0.5  # share of the walks
_MIRRORED = [i for name, i in _AT.items() if name in ("root_heading", "root_obliquity", "neck_bend", "neck_rotation")]
_SWAPPED = [_AT[name.replace("left_", "right_") if "left_" in name else name.replace("right_", "left_")]
            for name in POSE]  # fmt: skip
_OTHER_SIDE = [MARKERS.index(n.replace("left_", "right_") if "left_" in n else n.replace("right_", "left_"))
               for n in MARKERS]  # fmt: skip
#: Joints of CMU's dances (BVH) that stand for the 15 markers.
_DANCER = ("head", "chest", "hip", "lShldr", "rShldr", "lForeArm", "rForeArm", "lHand", "rHand", "lThigh", "rThigh",
           "lShin", "rShin", "lFoot", "rFoot")  # fmt: skip
#: For each limb marker, the neighbours towards and away from the trunk, along which its centre may be defined.
_NEIGHBOURS = {f"{side}_{joint}": (f"{side}_{inner}", f"{side}_{outer}")
               for side in ("left", "right")
               for inner, joint, outer in (("shoulder", "elbow", "wrist"), ("elbow", "wrist", "wrist"),
                                           ("hip", "knee", "ankle"), ("knee", "ankle", "ankle"),
                                           ("shoulder", "shoulder", "elbow"), ("hip", "hip", "knee"))}  # fmt: skip


@dataclass(frozen=True)
class Sources:
    """What clips are cut from: captured walks, captured dances (frames, 15, 3) at 120 Hz, and gait models."""

    walks: list[Motion]
    dances: list[np.ndarray]
    models: list
    drawn: list[Motion] = field(default_factory=list)  # walks of the models, which are slow to make


def read_sources(mocap: Path, left_out: tuple[str, ...] = (), models: tuple[str, ...] = ()) -> Sources:
    """CMU's walks without the subjects `left_out`, its dances, and gait models by name or file."""
    walks = []
    for path in sorted((mocap / "cmu_asfamc").rglob("*.amc")):
        if path.stem.split("_")[0] not in left_out:
            walks.append(_along_x(retarget(read(path, fps=120))))
    dances = []
    for path in sorted((mocap / "cmu_bvh_dance").glob("*/*.bvh")):
        capture = read(path, unit="cmu")  # the unit isn't known: legs give it
        places = capture.positions[:, [capture.names.index(name) for name in _DANCER]]
        thigh, shank = np.diff(places[:, [_M["left_hip"], _M["left_knee"], _M["left_ankle"]]], axis=1).swapaxes(0, 1)
        places = places * _LEG / np.median(np.linalg.norm(thigh, axis=1) + np.linalg.norm(shank, axis=1))
        dances.append(np.repeat(places, 2 if path.parent.name == "salsa" else 1, axis=0))
    names = models or ("walk/fpca", "walk/eigenwalkers")
    return Sources(walks, dances, [motionenv.load(name) for name in names])


def clip(sources: Sources, rng: np.random.Generator, frames: int = FRAMES, fps: float = RATE) -> np.ndarray | None:
    """One clip (frames, 15, 3) [m], NaN after its end; None if the chosen source couldn't make one."""
    kind = rng.uniform()
    if kind < _DANCED:
        made = _danced(sources, rng, frames, fps)
    else:
        made = _posed(sources, rng, kind, frames, fps)
    if made is None:
        return None
    made = _redefined(made, rng)
    if rng.uniform() < 0.12:
        made = made[::-1]
    if rng.uniform() < 0.10:
        made = _sidestepping(made, rng)
    out = np.full((frames, len(MARKERS), 3), np.nan, np.float32)
    out[: len(made)] = made
    return out


def restyled(sources: Sources, rng: np.random.Generator, frames: int, fps: float) -> np.ndarray | None:
    """A captured walk (frames, 15, 3) [m] in another person's style, proportions and joints; None if it's short."""
    made = _posed(sources, rng, _DANCED, frames, fps)
    return None if made is None else _redefined(made, rng)


def _along_x(motion: Motion) -> Motion:
    """The motion turned to travel along x from the origin."""
    poses = motion.poses.copy()
    way = poses[-1, :2] - poses[0, :2]
    angle = np.arctan2(way[1], way[0])
    poses[:, :2] = _turned(poses[:, :2] - poses[0, :2], -angle)
    poses[:, _AT["root_heading"]] -= angle
    return Motion(poses, motion.skeleton, motion.fps)


def _turned(ways: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return ways @ np.array([[c, s], [-s, c]])


def _posed(sources: Sources, rng, kind: float, frames: int, fps: float) -> np.ndarray | None:
    """Markers of the body in captured, drawn or running poses, in another person's style and proportions."""
    tempo = float(np.exp(rng.normal(0, 0.18)))
    seconds = frames / fps * tempo + 0.5
    running = kind > _WALKED
    if running:
        person = sources.walks[rng.integers(len(sources.walks))]
        motion = Motion(run(rng, seconds, 60.0), person.skeleton, 60.0)
    elif kind < _CAPTURED:
        motion = sources.walks[rng.integers(len(sources.walks))]
        if rng.uniform() < 0.7:
            motion = _bent(motion, rng)
    else:
        drawn = _drawn(sources, rng, seconds)
        if drawn is None:
            return None
        motion = drawn
    poses = np.column_stack([motion.poses[:, :3], np.unwrap(motion.poses[:, 3:], axis=0)])
    poses = _cut(poses, motion.fps / fps * tempo, frames, rng)
    if poses is None:
        return None
    poses, legs = _styled(poses, rng, running)
    if rng.uniform() < 0.5:
        poses = _mirror(poses)
    skeleton, longer = _proportioned(motion.skeleton, rng)
    places = markers(poses, skeleton) - poses[:, None, :3]
    root = poses[:, :3].copy()
    root[:, :2] *= legs * longer  # longer steps by longer legs and wider strides
    if not running:
        low = -places[:, _ANKLES, 2].min(axis=1)  # somebody always stands
        root[:, 2] = np.convolve(np.pad(low, 2, "edge"), np.full(5, 0.2), "valid") + rng.uniform(0.05, 0.12)
    else:
        root[:, 2] += rng.uniform(0.05, 0.12) - (root[:, None, 2] + places[:, _ANKLES, 2]).min()
    return places + root[:, None]


_ANKLES = [_M["left_ankle"], _M["right_ankle"]]


def _bent(motion: Motion, rng) -> Motion:
    try:
        return bend(motion, random_path(rng, 30.0, radius=rng.uniform(0.8, 6)))
    except MotionError:  # too sharp for this walk
        return motion


def _drawn(sources: Sources, rng, seconds: float) -> Motion | None:
    """A walk of a model, with changes of speed, stops and turns; each serves three clips."""
    if sources.drawn and rng.uniform() < 2 / 3:
        return sources.drawn[-1 - rng.integers(min(len(sources.drawn), 50))]
    model = sources.models[rng.integers(len(sources.models))]
    path = random_path(rng, 40.0, radius=rng.uniform(0.8, 6)) if rng.uniform() < 0.7 else None
    speed: float | list = rng.uniform(0.4, 2.3)
    if rng.uniform() < 0.25:
        at = np.add(np.sort(rng.uniform(0, seconds, 3)), [0.001, 0.02, 0.04])
        speed = [[0, speed], [at[0], speed], [at[1], rng.choice([0, 0.5, 1.5])], [at[2], rng.uniform(0.4, 1.8)]]
    try:
        walk = motionenv.synthesize(
            model, seconds, 60, seed=int(rng.integers(2**40)), path=path, speed=speed, variation=rng.uniform(0.5, 2)
        )
    except MotionError:  # a path too sharp for the speed
        return None
    sources.drawn.append(walk)
    return walk


def _cut(values: np.ndarray, step: float, frames: int, rng) -> np.ndarray | None:
    """A random piece of `values`, `step` of them from frame to frame; None if it has under a third of `frames`."""
    longest = int((len(values) - 2) / step)
    if longest < frames / 3:
        return None
    frames = min(frames, longest)
    at = rng.uniform(0, len(values) - 2 - (frames - 1) * step) + step * np.arange(frames)
    i = at.astype(int)
    part = (at - i).reshape(-1, *[1] * (values.ndim - 1))
    return values[i] * (1 - part) + values[i + 1] * part


def _styled(poses: np.ndarray, rng, running: bool) -> tuple[np.ndarray, float]:
    """Poses with other amplitudes, postures and slow changes, and the factor on the legs' amplitude."""
    poses, amplitude = poses.copy(), np.ones(len(POSE))
    plain = not running and rng.uniform() < _PLAIN
    amplitude[_ARMS] = rng.uniform(0.3, 2.0)
    amplitude[_LEGS] = legs = rng.uniform(0.8, 1.25)
    about = poses.mean(axis=0)
    if plain:  # knees that bend less are as straight in stance
        about[_KNEES] = np.quantile(poses[:, _KNEES], 0.1, axis=0)
        amplitude[_KNEES] = rng.uniform(0.7, 1.1)
    joints = slice(_AT["left_shoulder_flexion"], None)
    poses[:, joints] = (about + amplitude * (poses - about))[:, joints]
    spread = _SPREAD * (0.5 if running else 1.0)
    poses += spread * rng.standard_normal(len(POSE)) * (rng.uniform(0.2, 0.8) if plain else rng.uniform(0.3, 1.3))
    if not running:
        mean, deviation = _CROUCH["plain" if plain else "acted"]
        crouch = rng.normal(mean, deviation)
        poses[:, _KNEES] += crouch
        poses[:, _FLEXED] += crouch / 2  # the foot stays below the hip
    knots = rng.standard_normal((len(poses) // 12 + 3, len(POSE)))
    at = np.arange(len(poses)) / 12
    i, part = at.astype(int), (at % 1)[:, None]
    part = part * part * (3 - 2 * part)
    poses += (0.2 if plain else 0.4) * spread * (knots[i] * (1 - part) + knots[i + 1] * part)
    for name, index in _AT.items():
        if "knee" in name or "elbow" in name:
            poses[:, index] = np.maximum(poses[:, index], 0.02)
    return poses, legs


def _mirror(poses: np.ndarray) -> np.ndarray:
    mirrored = poses[:, _SWAPPED]
    mirrored[:, 1] *= -1
    mirrored[:, _MIRRORED] *= -1
    return mirrored


def _proportioned(skeleton: Skeleton, rng) -> tuple[Skeleton, float]:
    """A skeleton with other proportions, symmetric, and how much longer its legs are."""
    offsets = skeleton.offsets * np.exp(rng.normal(0, 0.08, (len(NODES), 1)))
    for i, name in enumerate(NODES):
        if name.startswith("left_"):
            offsets[NODES.index("right_" + name[5:])] = offsets[i] * [1, -1, 1]
    offsets *= rng.uniform(1.45, 1.95) / skeleton.height
    legs = [NODES.index("left_knee"), NODES.index("left_ankle")]
    longer = np.linalg.norm(offsets[legs], axis=1).sum() / np.linalg.norm(skeleton.offsets[legs], axis=1).sum()
    return Skeleton(offsets, skeleton.radii, skeleton.height), float(longer)


def _danced(sources: Sources, rng, frames: int, fps: float) -> np.ndarray | None:
    """A piece of a dance, mirrored or not, by a taller or shorter dancer."""
    dance = sources.dances[rng.integers(len(sources.dances))]
    made = _cut(dance, 120.0 / fps * float(np.exp(rng.normal(0, 0.2))), frames, rng)
    if made is None:
        return None
    made = (made - [*made[0, _M["pelvis"], :2], 0.0]) * rng.uniform(0.85, 1.15)
    if rng.uniform() < 0.5:
        made = made[:, _OTHER_SIDE] * [1, -1, 1]
    made[..., 2] += rng.uniform(0.05, 0.12) - np.quantile(made[:, _ANKLES, 2].min(axis=1), 0.1)
    return made


def _redefined(places: np.ndarray, rng) -> np.ndarray:
    """Joint centres as another system of markers would define them: shifted along the limbs, and in the trunk."""
    out = places.copy()
    for joint, (inner, outer) in _NEIGHBOURS.items():
        share = rng.normal(0, 0.04, 2)
        here = places[:, _M[joint]]
        out[:, _M[joint]] += share[0] * (places[:, _M[inner]] - here) + share[1] * (places[:, _M[outer]] - here)
    across = places[:, _M["left_shoulder"]] - places[:, _M["right_shoulder"]]
    up = places[:, _M["sternum"]] - places[:, _M["pelvis"]]
    for names, spread in (
        (("head",), (0.02, 0.05, 0.05)), (("sternum",), (0.01, 0.07, 0.06)), (("pelvis",), (0.005, 0.03, 0.04)),
        (("left_hip", "right_hip"), (0.08, 0.03, 0.03)), (("left_shoulder", "right_shoulder"), (0.08, 0.03, 0.03)),
    ):  # fmt: skip
        wide, forward, high = rng.normal(0, spread)
        ahead = np.cross(across, up) / np.linalg.norm(up, axis=1, keepdims=True)
        for name in names:
            side = 0.5 if name.startswith("left") else -0.5 if name.startswith("right") else 1.0
            out[:, _M[name]] += side * wide * across + forward * ahead + high * up
    return out


def _sidestepping(places: np.ndarray, rng) -> np.ndarray:
    """The same body in another direction of travel."""
    way = places[:, _M["pelvis"], :2] - places[0, _M["pelvis"], :2]
    out = places.copy()
    out[..., :2] += (_turned(way, rng.choice([-1, 1]) * rng.uniform(0.8, 1.7)) - way)[:, None]
    return out


def main() -> None:
    """Write clips to a file."""
    parser = Arguments(__doc__, mocap=("cmu_asfamc", "cmu_bvh_dance"))
    parser.add_argument("--count", type=int, default=8000, quick=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True, quick=scratch() / "clips.npy")
    parser.add_argument("--leave-out", nargs="*", default=[], help="subjects of CMU")
    parser.add_argument("--models", nargs="*", default=[], help="gait models; by default the shipped ones")
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        sources = read_sources(asked.mocap, tuple(asked.leave_out), tuple(asked.models))
        made: list[np.ndarray] = []
        while len(made) < asked.count:
            new = clip(sources, rng)
            if new is not None and np.isfinite(new[:20]).all():
                made.append(new)
                if len(made) % 500 == 0:
                    print(f"{len(made)} of {asked.count} clips", flush=True)
    np.save(asked.out, np.stack(made))


if __name__ == "__main__":
    main()
