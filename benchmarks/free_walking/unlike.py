"""How often lifting says that postures are unlike people who walk: of people left out, and of what isn't walking.

motionenv bench free_walking.unlike --network a.npz --models A B
"""

import numpy as np

from benchmarks.free_walking import left_out
from motionenv.body import from_height, markers
from motionenv.lifting.free.lifter import SURPRISE, fit_freely
from motionenv.mocap import read, to_markers
from motionenv.types import MARKERS, POSE, Markers

FPS = 30.0
_AT = {name: i for i, name in enumerate(POSE)}
_TIME = np.arange(90) / FPS


def _posed(angles: dict[str, tuple[float, float, float]], tilt: float, height: float, speed: float) -> Markers:
    """A body whose joints swing: mean, amplitude and phase [rad] by the name of an angle without its side."""
    poses = np.zeros((len(_TIME), len(POSE)))
    poses[:, _AT["root_tilt"]], poses[:, 0], poses[:, 2] = tilt, speed * _TIME, height
    for side, shift in (("left", 0.0), ("right", np.pi)):
        for name, (mean, swing, phase) in angles.items():
            poses[:, _AT[f"{side}_{name}"]] = mean + swing * np.sin(2 * np.pi * 1.3 * _TIME + shift + phase)
    return Markers(MARKERS, markers(poses, from_height(1.75)), FPS)


def others(rng: np.random.Generator) -> dict[str, list[Markers]]:
    """What isn't walking: sitting, cycling, going on all fours, exchanged joints, and noise."""
    sit = {"hip_flexion": (1.5, 0.03, 0.0), "knee_flexion": (1.5, 0.02, 0.0)}
    cycle = {"hip_flexion": (1.6, 0.45, 0.0), "knee_flexion": (1.3, 0.55, 0.9), "shoulder_flexion": (1.2, 0.0, 0.0)}
    crawl = {"hip_flexion": (1.4, 0.4, 0.0), "knee_flexion": (0.5, 0.3, 1.0), "shoulder_flexion": (1.4, 0.4, 3.0)}
    walk = _posed({"hip_flexion": (0.2, 0.4, 0.0), "knee_flexion": (0.5, 0.4, 1.0)}, 0.0, 0.9, 1.2)
    noise = [walk.positions.mean(axis=0) + 0.3 * rng.standard_normal(walk.positions.shape) for _ in range(4)]
    mixed = [walk.positions[:, rng.permutation(len(MARKERS))] for _ in range(4)]
    wrapped = lambda each: [Markers(MARKERS, places, FPS) for places in each]
    return {
        "sitting": 4 * [_posed(sit, 0.0, 0.5, 0.0)], "cycling": 4 * [_posed(cycle, 0.6, 0.9, 3.0)],
        "on all fours": 4 * [_posed(crawl, 1.4, 0.7, 1.0)], "joints mixed up": wrapped(mixed), "noise": wrapped(noise),
    }  # fmt: skip


def main() -> None:
    """Print shares of frames and sequences."""
    parser = left_out.arguments(__doc__, models=True)
    asked = parser.parse_args()
    network = left_out.network(asked.network)
    rng = np.random.default_rng(0)
    most = 1 if asked.quick else None
    varied = left_out.varied(asked.mocap, tuple(asked.models), 1 if asked.quick else 30)
    people = {"people left out": left_out.captured(asked.mocap)[:most], "… in exaggerated styles": varied}
    shown = {**people, **others(rng)}
    for activity in ("bow", "kick", "punch", "dance", "wave"):
        paths = sorted((asked.mocap / "bandai_namco").rglob(f"*_{activity}*.bvh"))[:5]
        shown[f"Bandai-Namco, {activity}"] = [to_markers(read(path)) for path in paths]
    print("| motion | points | frames unlike | sequences not plausible |\n|-|-|-|-|")
    for name, motions in shown.items():
        for damage in left_out.DAMAGE if name in people else ["clean"]:
            fits = [
                fit_freely(one.points, one.camera, network=network)
                for one in left_out.sequences(motions[:most]) if one.damage == damage
            ]  # fmt: skip
            frames = np.concatenate([fit.surprise for fit in fits]) > SURPRISE
            wrong = np.mean([not fit.plausible for fit in fits])
            print(f"| {name} | {damage} | {frames.mean():.1%} | {wrong:.0%} |", flush=True)


if __name__ == "__main__":
    main()
