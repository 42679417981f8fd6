"""Sequences of people whom a network hasn't seen, to choose settings and calibrate bands on.

They come from CMU's subjects `LEFT_OUT`, as captured, and as clips of other styles, proportions, tempos and definitions
of joints (`clips`), at 30 frames per second before cameras like those of the benchmark. The network is one of its own:

    motionenv bench free_walking.clips --leave-out 07 16 26 32 38 49 --models A B --out a.npy
    motionenv bench free_walking.train a.npy --minutes 22 --out a.npz

with models A and B fitted to the other people (`motionenv fit`).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import Arguments
from benchmarks.free_walking import bandai, clips
from motionenv.body import markers
from motionenv.lifting.free.posture_network import PostureNetwork, shipped_network
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.types import MARKERS, Camera, Markers, Points

LEFT_OUT = ("07", "16", "26", "32", "38", "49")
FPS = 30.0
DAMAGE = {"clean": lambda points, rng: points, "5 px, 20 % missing": bandai.noisy, "bursts": bandai.bursts}
DETECTED = {"detector's errors": lambda points, rng: DetectorErrors().apply(points, rng)}


def arguments(doc: str, *, models: bool = False) -> Arguments:
    """The command line of what is measured on people left out."""
    parser = Arguments(doc, mocap=("cmu_asfamc", "cmu_bvh_dance", "bandai_namco"))
    parser.add_argument("--network", type=Path, required=True, quick="shipped", help="weights (.npz) of `train`")
    if models:
        shipped = ("walk/fpca", "walk/eigenwalkers")
        parser.add_argument("--models", nargs=2, required=True, quick=shipped, help="without the people left out")
    return parser


def network(path: Path | str) -> PostureNetwork:
    """The network with the weights of a file, or the shipped one."""
    if str(path) == "shipped":
        return shipped_network()
    with np.load(path) as weights:
        return PostureNetwork(dict(weights))


@dataclass(frozen=True)
class Sequence:
    """Points of somebody left out, the camera, the true positions, and how the points were damaged."""

    points: Points
    camera: Camera
    damage: str

    @property
    def truth(self) -> np.ndarray:
        """The true positions (frames, 15, 3) [m]."""
        assert self.points.truth is not None
        return self.points.truth.positions


def captured(mocap: Path) -> list[Markers]:
    """The walks of the people left out, at 30 Hz."""
    others = tuple({path.name for path in (mocap / "cmu_asfamc").iterdir()} - set(LEFT_OUT))
    walks = clips.read_sources(mocap, others).walks
    return [Markers(MARKERS, markers(w.poses, w.skeleton)[:: round(w.fps / FPS)], FPS) for w in walks]


def varied(mocap: Path, models: tuple[str, ...], count: int, seed: int = 77) -> list[Markers]:
    """Clips of the people left out, in other styles and proportions."""
    others = tuple({path.name for path in (mocap / "cmu_asfamc").iterdir()} - set(LEFT_OUT))
    sources, rng, out = clips.read_sources(mocap, others, models), np.random.default_rng(seed), []
    while len(out) < count:
        made = clips.clip(sources, rng, frames=128, fps=FPS)
        if made is not None and np.isfinite(made[:60]).all():
            out.append(Markers(MARKERS, made[np.isfinite(made[:, 0, 0])].astype(float), FPS))
    return out


def sequences(people: list[Markers], seed: int = 0, damages: dict = DAMAGE) -> Iterator[Sequence]:
    """Each of them before one camera, undamaged and damaged."""
    for number, walk in enumerate(people):
        rng = np.random.default_rng([seed, number])
        camera = bandai.cameras(walk, rng)[0]
        for name, damage in damages.items():
            yield Sequence(damage(bandai.seen(walk, camera), rng), camera, name)
