"""Bandai-Namco's walks, turns and runs before cameras: a data set that nothing shipped was fitted to or chosen on."""

from pathlib import Path

import numpy as np

from motionenv.mocap import read, to_markers
from motionenv.render.cameras import fit_view, project
from motionenv.types import MARKERS, Camera, Markers, Points

FPS = 30.0
KINDS = {
    "forward walks": ("_walk_",),
    "all walks": ("_walk_", "_walk-back_", "_walk-left_", "_walk-right_"),
    "turns": ("_walk-turn-left_", "_walk-turn-right_"),
    "runs": ("_run_", "_dash_"),
}
CLIPS, VIEWS = 12, 3
PICTURE = {"width": 640, "height": 480}


def clips(mocap: Path, kind: str, count: int = CLIPS, *, skip: int = 0) -> list[Markers]:
    """`count` clips of a kind, chosen at random but the same each time, standing over the origin on average.

    With `skip`, others than the first so many.
    """
    paths = sorted(p for p in (mocap / "bandai_namco").rglob("*.bvh") if any(part in p.name for part in KINDS[kind]))
    chosen = sorted(np.random.default_rng(0).permutation(len(paths))[skip : skip + count])
    out = []
    for i in chosen:
        markers = to_markers(read(paths[i]))
        middle = np.nanmean(markers.positions[:, MARKERS.index("pelvis")], axis=0) * [1, 1, 0]
        out.append(Markers(MARKERS, markers.positions - middle, markers.fps, name=paths[i].stem))
    return out


def cameras(markers: Markers, rng: np.random.Generator) -> list[Camera]:
    """Three cameras around a clip that see all of it, looking down by 1 to 14 degrees."""
    first = rng.uniform(0, 2 * np.pi)
    return [
        fit_view(markers.positions, first + 2 * np.pi * i / VIEWS + 0.3, elevation=rng.uniform(0.02, 0.25), **PICTURE)
        for i in range(VIEWS)
    ]


def seen(markers: Markers, camera: Camera) -> Points:
    """What a camera sees of the markers, in pixels."""
    return Points(project(markers.positions, camera)[0], markers.fps, "px", truth=markers, name=markers.name)


def elevation(camera: Camera) -> float:
    """By how much the camera looks down [rad]: a spirit level tells it, even where nothing else is known."""
    return float(np.arcsin(np.clip(-camera.R[2, 2], -1, 1)))


def noisy(points: Points, rng: np.random.Generator) -> Points:
    """5 pixels of noise, and 20 % of the points missing."""
    positions = points.positions + 5 * rng.standard_normal(points.positions.shape)
    positions[rng.uniform(size=positions.shape[:2]) < 0.2] = np.nan
    return Points(positions, points.fps, "px", points.truth, points.name)


def bursts(points: Points, rng: np.random.Generator) -> Points:
    """One joint after the other missing for 0.3 to 1 s, 20 % in all."""
    positions = points.positions.copy()
    while np.isnan(positions[..., 0]).mean() < 0.2:
        begin = rng.integers(len(positions))
        length = rng.integers(round(0.3 * points.fps), round(points.fps) + 1)
        positions[begin : begin + length, rng.integers(len(MARKERS))] = np.nan
    return Points(positions, points.fps, "px", points.truth, points.name)
