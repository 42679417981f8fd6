"""How often lifting doubts a wrong shape of the picture, or a wrong frame rate, and how often right ones.

    motionenv bench lifting.wrong_input --network FILE

Points are made wider or narrower, and their frame rate is told wrongly. Thresholds were set on CMU's people left out of
a network (`--network`, see `free_walking.left_out`) and so that no capture at hand and no real film is doubted; on
laboratories' walkers they weren't. Cameras are unknown but for the angle by which they look down; "level" takes that,
too, for 0, with a detector's errors. A rate can only be told where a stride is seen, as in all of CMU's films, but in
25 of laboratories' 55. Pose2Sim's films are real ones, mostly of somebody who balances, as BlazePose sees them.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import Arguments, has, headline
from benchmarks.free_walking import bandai, left_out
from benchmarks.lifting import laboratory
from motionenv.lifting import Lifted, fit_freely
from motionenv.lifting.free.lifter import picture_shape
from motionenv.lifting.free.posture_network import PostureNetwork, shipped_network
from motionenv.lifting.gait import doubts_about
from motionenv.lifting.side_labels import continuous_labels, swapped_back
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.types import Points

SHAPES, RATES = (1.0, 9 / 16, 3 / 4, 4 / 3, 16 / 9), (1.0, 2.0, 0.5)
Film = tuple[Points, float]  # and by how much its camera looks down [rad]


def made_wider(points: Points, ratio: float) -> Points:
    """The points as if their picture were made so many times as wide."""
    middle = np.nanmean(points.positions, axis=(0, 1)) * [1, 0]
    return replace(points, positions=middle + (points.positions - middle) * [ratio, 1], feet=None, truth=None)


def of_shape(points: Points, elevation: float, network: PostureNetwork) -> int:
    """As `FreeFit.shape`, without the fit."""
    labelled = swapped_back(points, continuous_labels(points))
    return picture_shape(network, labelled, None, None, elevation)


def of_rate(points: Points, elevation: float, network: PostureNetwork) -> bool:
    """Whether the frame rate is doubted."""
    fit = fit_freely(points, None, elevation=elevation, network=network)
    return "frame rate" in " ".join(doubts_about(Lifted(swapped_back(points, fit.swapped), fit.swapped, fit)))


def acted(mocap: Path, count: int) -> Iterator[Film]:
    """Bandai-Namco's walks, turns and runs."""
    for kind in bandai.KINDS:
        for clip in bandai.clips(mocap, kind, count):
            camera = bandai.cameras(clip, np.random.default_rng(len(clip.positions)))[0]
            yield bandai.seen(clip, camera), bandai.elevation(camera)


def walkers(mocap: Path, most: int | None) -> Iterator[Film]:
    """Laboratories' walks in five views."""
    for one in laboratory.in_no_fit(mocap, most):
        for view, (_, down) in laboratory.VIEWS.items():
            if view != "hand-held":
                yield laboratory.film(one, view, np.random.default_rng(0))[1], down


def people(mocap: Path, most: int | None) -> Iterator[Film]:
    """Walks of CMU's people left out, two cameras each."""
    for number, walk in enumerate(left_out.captured(mocap)[:most]):
        for camera in bandai.cameras(walk, np.random.default_rng([0, number]))[:2]:
            yield bandai.seen(walk, camera), bandai.elevation(camera)


def real(mocap: Path, most: int | None) -> Iterator[Film]:
    """Everybody whom BlazePose sees in most of one of Pose2Sim's films."""
    from motionenv.mocap.keypoints.detector import detect_people, detector
    from motionenv.mocap.keypoints.points2d import points_of
    from motionenv.render.video.decode import read_frames, video_info

    for path in sorted((mocap / "pose2sim").glob("Demo_*/videos/*.mp4"))[:most]:
        tracks, frames = detect_people(read_frames(path), detector(), name=str(path))
        for track in tracks:
            if len(track) > 0.4 * frames:
                yield points_of(path, [track], frames, video_info(path).fps)[0], 0.0


def row(films: list[Film], network: PostureNetwork, detected: bool, level: bool) -> tuple[str, float]:
    """Shares of `films` that are doubted, as a row, and the share of right ones whose shape is."""
    damage = lambda points, i: DetectorErrors().apply(points, np.random.default_rng([1, i])) if detected else points
    hurt = [(damage(points, i), 0.0 if level else down) for i, (points, down) in enumerate(films)]
    found = [[of_shape(made_wider(points, ratio), down, network) for points, down in hurt] for ratio in SHAPES]
    shapes = [np.mean(np.array(one) == (1 if ratio > 1 else -1)) for one, ratio in zip(found, SHAPES, strict=True)]
    shapes[0] = np.mean(np.array(found[0]) != 0)
    rates = [] if level and detected else [
        np.mean([of_rate(replace(points, fps=f * points.fps, truth=None), down, network) for points, down in hurt])
        for f in RATES
    ]  # fmt: skip
    return " | ".join([*(f"{share:.0%}" for share in (*shapes, *rates)), *["–"] * (3 - len(rates))]), float(shapes[0])


def main() -> None:
    """Print a table."""
    parser = Arguments(__doc__, mocap=("btkdata", "nimble", "cmu_asfamc", "bandai_namco"))
    parser.add_argument("--network", type=Path, required=True, quick="shipped", help="weights without CMU's people")
    asked = parser.parse_args()
    most, network = (2 if asked.quick else None), shipped_network()
    groups = [("CMU's people left out", people(asked.mocap, most), left_out.network(asked.network)),
              ("laboratories", walkers(asked.mocap, most), network),
              ("Bandai-Namco, acted", acted(asked.mocap, 1 if asked.quick else 6), network)]  # fmt: skip
    wrong = " | ".join(f"width × {ratio:.2f}" for ratio in SHAPES[1:])
    print(f"| people | points | films | right shape | {wrong} | right rate | rate × 2 | rate × 0.5 |\n|" + "-|" * 11)
    for name, made, chosen in groups:
        films = list(made)[:most]
        for points, detected, level in (
            ("exact", False, False),
            ("a detector's errors", True, False),
            ("level", True, True),
        ):
            cells, doubted = row(films, chosen, detected, level)
            print(f"| {name} | {points} | {len(films)} | {cells} |", flush=True)
            if (name, detected, level) == ("laboratories", True, False):
                headline(doubted=doubted)
    if (asked.mocap / "pose2sim").is_dir() and has("ai_edge_litert"):
        films = list(real(asked.mocap, most))
        print(f"| Pose2Sim's films | BlazePose's | {len(films)} | {row(films, network, False, True)[0]} |")


if __name__ == "__main__":
    main()
