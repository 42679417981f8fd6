"""Lift people who walk, turn, step aside and run, of a data set that nothing shipped has seen.

    motionenv bench free_walking [--clips 12] [--network FILE] [--only "turns"]
    motionenv bench free_walking --hour
    motionenv bench free_walking --baselines CLIPS.npy

Twelve clips of each kind of Bandai-Namco's motions (acted styles, three actors) before three cameras each, which see
the whole clip in 640 x 480 pixels from 1 to 14 degrees above. MPJPE aligns the pelvis in the axes of the world;
P-MPJPE also rotates, scales and moves every frame. "Heading" is the mean error of the body's direction, "flipped"
counts sequences in which it is wrong by more than 90 degrees for over a tenth of the time, "in band" joint
coordinates inside their 90 % bands. Settings were chosen by `tune` on CMU's people; nothing was chosen here.
"""

import pathlib
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import motionenv
from benchmarks import Arguments, headline
from benchmarks.free_walking import bandai, baselines, left_out
from motionenv.body import markers
from motionenv.lifting.free.lifter import FreeFit, fit_freely
from motionenv.lifting.free.posture_network import BODY_UNIT, PostureNetwork, propose, shipped_network
from motionenv.lifting.free.rays import rays_of
from motionenv.metrics import aligned_mpjpe, pelvis_mpjpe
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.models.paths import WalkPath
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Camera, Points

PELVIS = MARKERS.index("pelvis")


@dataclass(frozen=True)
class Row:
    """A way in which points are damaged, and what is known of the camera."""

    name: str
    damage: Callable[[Points, np.random.Generator], Points]
    known: Callable[[Camera], object] = lambda camera: camera


ROWS = (
    Row("clean", lambda points, rng: points),
    Row("5 px and 20 % missing", bandai.noisy),
    Row("bursts of 0.3 to 1 s, 20 % in all", bandai.bursts),
    Row("detector's errors", lambda points, rng: DetectorErrors().apply(points, rng)),
    Row("intrinsics known, pose unknown", lambda points, rng: points, lambda camera: camera.K),
    Row("camera unknown", lambda points, rng: points, lambda camera: None),
)


def figures(fit: FreeFit, points: Points, told: object) -> dict[str, float]:
    """Errors of one sequence."""
    truth = points.truth.positions
    positions = fit.positions if isinstance(told, Camera) else _turned_alike(fit.positions, truth)
    about = lambda places: places - places[:, [PELVIS]]
    inside = np.abs(about(positions) - about(truth)) < 1.645 * fit.deviations
    off = heading(positions) - heading(truth)
    off = np.abs((off + np.pi) % (2 * np.pi) - np.pi)
    return {
        "mpjpe": 1e3 * float(np.nanmean(pelvis_mpjpe(positions, truth))),
        "aligned": 1e3 * float(np.nanmean(aligned_mpjpe(positions, truth))),
        "heading": float(np.degrees(off.mean())),
        "flipped": float((off > np.pi / 2).mean() > 0.1),
        "in_band": float(np.delete(inside, PELVIS, axis=1).mean()),
        "scale": float(np.linalg.norm(about(positions), axis=-1).mean() / np.linalg.norm(about(truth), axis=-1).mean()),
    }


def heading(positions: np.ndarray) -> np.ndarray:
    """Direction of the body (frames,) [rad] from its hips."""
    across = positions[:, MARKERS.index("left_hip")] - positions[:, MARKERS.index("right_hip")]
    return np.arctan2(-across[:, 0], across[:, 1])


def _turned_alike(positions: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Positions turned about the vertical to fit the truth's postures: an unknown camera knows no azimuth."""
    a, b = (places - places[:, [PELVIS]] for places in (positions, truth))
    product = (a[..., 0] + 1j * a[..., 1]).conj() * (b[..., 0] + 1j * b[..., 1])
    angle = np.angle(np.nansum(product))
    c, s = np.cos(angle), np.sin(angle)
    return positions @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])


def alone(network: PostureNetwork, points: Points, camera: Camera) -> float:
    """MPJPE [mm] of the network's proposals, at an average person's size."""
    posture = propose(network, rays_of(points.positions, camera).directions, points.fps).posture
    truth = points.truth.positions
    return 1e3 * float(np.nanmean(np.linalg.norm(posture * BODY_UNIT - truth + truth[:, [PELVIS]], axis=-1)))


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__, mocap=True)
    parser.add_argument("--clips", type=int, default=bandai.CLIPS, quick=1)
    parser.add_argument("--network", type=pathlib.Path, help="another network's weights (.npz)")
    parser.add_argument("--only", choices=list(bandai.KINDS))
    parser.add_argument("--baselines", type=pathlib.Path, help="clips (see `clips`) for a table of simple lifters")
    parser.add_argument("--hour", action="store_true", help="time and memory of a minute and an hour, synthetic")
    asked = parser.parse_args()
    if asked.hour or asked.quick:
        print(_hour((1, 2) if asked.quick else (1, 60)))
    if asked.mocap is None:
        return
    if asked.quick:
        seen = [clip.positions for clip in bandai.clips(asked.mocap, "all walks", asked.clips)]
        print(_baselines(asked.mocap, np.concatenate(seen)[None], asked.clips))
    if asked.baselines is not None:
        print(_baselines(asked.mocap, np.load(asked.baselines), asked.clips))
    elif not asked.hour:
        network = shipped_network() if asked.network is None else left_out.network(asked.network)
        _table(asked, network)


def _table(asked, network: PostureNetwork) -> None:
    print("| points | motion | MPJPE [mm] | network alone | P-MPJPE [mm] | heading [°] | flipped | in band | size "
          "| s per s |\n|-|-|-|-|-|-|-|-|-|-|")  # fmt: skip
    for row in ROWS:
        for kind in [asked.only] if asked.only else bandai.KINDS:
            clips = bandai.clips(asked.mocap, kind, asked.clips)
            mean, told = _line(row, kind, network, clips, 1 if asked.quick else bandai.VIEWS)
            print(told, flush=True)
            if (row, kind) == (ROWS[0], "turns"):
                headline(turns=mean["mpjpe"], network=mean["alone"])


def _line(row: Row, kind: str, network: PostureNetwork, clips: list, views: int) -> tuple[dict[str, float], str]:
    """Mean errors of clips before so many cameras, and a row of the table."""
    each, spent, seconds = [], 0.0, 0.0
    for clip in clips:
        rng = np.random.default_rng(sum(map(ord, clip.name)))
        for camera in bandai.cameras(clip, rng)[:views]:
            points = row.damage(bandai.seen(clip, camera), rng)
            told = row.known(camera)
            begun = time.process_time()
            fit = fit_freely(points, told, elevation=bandai.elevation(camera), network=network)
            spent += time.process_time() - begun
            seconds += len(points.positions) / points.fps
            each.append(figures(fit, points, told) | {"alone": alone(network, points, camera)})
    mean = {name: np.mean([one[name] for one in each]) for name in each[0]}
    flips = int(sum(one["flipped"] for one in each))
    return mean, (
        f"| {row.name} | {kind} | {mean['mpjpe']:.1f} | {mean['alone']:.1f} | {mean['aligned']:.1f} | "
        f"{mean['heading']:.1f} | {flips} of {len(each)} | {mean['in_band']:.0%} | {mean['scale']:.3f} | "
        f"{spent / seconds:.2f} |"
    )


def _baselines(mocap: pathlib.Path, learned: np.ndarray, count: int) -> str:
    """MPJPE of simple lifters on clean points, as a table."""
    lines = ["| motion | mean posture [mm] | nearest neighbour [mm] |", "|-|-|-|"]
    for kind in bandai.KINDS:
        sequences = []
        for clip in bandai.clips(mocap, kind, count):
            rng = np.random.default_rng(sum(map(ord, clip.name)))
            sequences += [(bandai.seen(clip, camera), camera) for camera in bandai.cameras(clip, rng)]
        found = baselines.errors(learned, sequences)
        lines.append(f"| {kind} | {found['mean posture']:.0f} | {found['nearest neighbour']:.0f} |")
    return "\n".join(lines)


def _hour(durations: tuple[int, ...]) -> str:
    """CPU time and peak memory of lifting minutes of a walk in a circle, with 2 pixels of noise."""
    walk = motionenv.synthesize("walk/fpca", 60.0, 30.0, seed=4, path=WalkPath.arc(1.6, 60.0), speed=1.0)
    places = markers(walk.poses, walk.skeleton)
    camera = fit_view(places, 0.4, elevation=0.12, **bandai.PICTURE)
    pixels = camera.project(places)[0] + 2 * np.random.default_rng(0).standard_normal((*places.shape[:2], 2))
    told = []
    for minutes in durations:
        begun = time.process_time()
        fit_freely(Points(np.tile(pixels, (minutes, 1, 1)), 30.0, "px"), camera)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        told.append(f"{minutes} min: {time.process_time() - begun:.1f} s of CPU, peak memory {peak:.0f} MB")
    return "\n".join(told)


if __name__ == "__main__":
    main()
