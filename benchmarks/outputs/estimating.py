"""Outputs of likelihoods, tracking and lifting."""

import dataclasses
import functools
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import motionenv
from benchmarks.outputs.cases import camera, markers_of, near, output, tree, walk


@functools.cache
def pictures(frames: int = 12) -> motionenv.Frame:
    """Pictures of the walk from the small camera."""
    from motionenv.render import render

    return render(walk().poses[:frames], walk().skeleton, camera())


def model(name: str) -> Any:
    """A likelihood with known camera and body."""
    from motionenv import likelihoods

    return getattr(likelihoods, name)(camera(), walk().skeleton)


@output("likelihood of silhouettes", "SilhouetteLikelihood", "mask")
@output("likelihood of colours", "SilhouetteLikelihood", "rgb")
@output("likelihood of depth", "SilhouetteLikelihood", "depth")
def _likelihood(name: str, *senses: str) -> Any:
    made, seen, found = model(name), pictures(), []
    given = {"mask": seen.limbs > 0, "rgb": seen.rgb, "depth": seen.depth}
    for i in range(0, 12, 3):
        made.observe(**{sense: given[sense][i] for sense in senses})
        if hasattr(made, "learn"):
            made.learn(walk().poses[i])
        found.append(made.log_likelihood(near(walk().poses[i])))
    return found


@output("likelihood of points in a picture", pixels=True)
@output("likelihood of points in metres", pixels=False)
def _point_likelihood(pixels: bool) -> Any:
    from motionenv.likelihoods import MarkerLikelihood
    from motionenv.render.cameras import orthographic

    pose = walk().poses[3]
    points = motionenv.markers(pose, walk().skeleton)
    made = MarkerLikelihood(camera() if pixels else 0.4, walk().skeleton)
    made.observe(camera().project(points)[0] if pixels else orthographic(points, 0.4), np.arange(15) % 4 > 0)
    return made.log_likelihood(near(pose))


def prior(name: str) -> Any:
    """A motion prior for the walker's body."""
    from motionenv import tracking

    body = walk().skeleton
    return getattr(tracking, name)(skeleton=body, **({"tree": tree()} if name == "TreePrior" else {}))


@output("track with FPCAPrior", "FPCAPrior")
@output("track with FPCAPrior and annealing", "FPCAPrior", layers=2)
@output("track with TreePrior", "TreePrior", layers=2)
@output("track with VelocityPrior", "VelocityPrior")
def _track(name: str, **options) -> Any:
    from motionenv.tracking import ParticleFilter, Start

    made = prior(name)
    tracker = ParticleFilter(made, model("SilhouetteLikelihood"), n=150, seed=1, **options)
    tracker.start(Start.at(walk().poses[0]))
    beliefs = [tracker.step(mask=limbs > 0) for limbs in pictures().limbs]
    return [[b.poses, b.log_weights, b.mean, b.effective, b.log_evidence, b.lost] for b in beliefs]


@output("start found in pictures")
def _start() -> Any:
    from motionenv.tracking.initialization import automatic_start

    seen = [{"mask": limbs > 0} for limbs in pictures().limbs[:6]]
    return automatic_start(model("SilhouetteLikelihood"), seen, n=500, candidates=8, seed=5)


@output("track of a film")
def _video_track() -> Any:
    from motionenv.body import markers
    from motionenv.render import cameras, render
    from motionenv.tracking.video.track import Film, track_video
    from motionenv.types import Points

    watching = cameras.view(0.0, distance=5.0, width=128, height=96)
    poses = walk().poses - np.eye(25)[0] * walk().poses[:, :1].mean()
    noise = 4 * np.random.default_rng(5).standard_normal((len(poses), 96, 128, 3))
    drawn = render(poses, walk().skeleton, watching).rgb + noise
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.mp4"
        motionenv.write_video(path, np.clip(drawn, 0, 255).astype(np.uint8), 30)
        points = Points(watching.project(markers(poses, walk().skeleton))[0], 30, "px")
        track = track_video(Film(path, detections=points), watching, height=1.75, particles=150, seed=1)
    return dataclasses.replace(track, motion=dataclasses.replace(track.motion, name="walk"))  # not the folder's name


@output("agents play WalkerTracking")
def _agents() -> Any:
    import gymnasium

    from motionenv.envs.agents import Kalman, MeanPose, Oracle, TrackingAgent, evaluate, truth_start

    env = gymnasium.make("motionenv/WalkerTracking-v1", observation="mask", size=48, horizon=10)
    agents = {make.__name__: make(env) for make in (MeanPose, Kalman, Oracle)}
    agents["TrackingAgent"] = TrackingAgent(env, n=50, start=truth_start, seed=1)
    return {name: evaluate(env, agent, episodes=2, seed=1) for name, agent in agents.items()}


# ── lifting ───────────────────────────────────────────────────────────────────────────────────────────────────────────


def points(alpha: float = 0.7, missing: float = 0.0, **how) -> motionenv.Points:
    """2D points of a four-second walk, with a share of them missing."""
    from motionenv.lifting import project_markers

    seen = project_markers(markers_of(walk(4.0)), alpha, **how)
    gone = np.random.default_rng(1).random((*seen.positions.shape[:2], 1)) < missing
    return motionenv.Points(np.where(gone, np.nan, seen.positions), seen.fps, seen.unit)


@output("lift of points in metres")
@output("lift with points missing", missing=0.3)
@output("lift of an unknown elevation", elevation=None, seen={"elevation": 0.2})
def _lift(missing: float = 0.0, seen: dict | None = None, **how) -> Any:
    lifted = motionenv.lift(points(missing=missing, **seen or {}), **how)
    return [lifted, lifted.band, lifted.markers(), lifted.motion()]


@output("lift with a camera")
def _lift_by_camera() -> Any:
    watching = motionenv.fit_view(markers_of(walk(4.0)).positions, 0.5, width=640, height=480, elevation=0.1)
    seen = points(0.5, elevation=0.1, camera=watching, heading=0.0)
    lifted = motionenv.lift(seen, camera=watching)
    return [seen, lifted, lifted.band, lifted.motion()]


@output("lifting known views: least squares and MAP")
def _known() -> Any:
    from motionenv.lifting import fourier_points, least_squares, maximum_a_posteriori

    series, walkers = fourier_points(points()), motionenv.load("walk/prior")
    found = [
        least_squares(walkers, series.coefficients, 0.7, n_components=6),
        maximum_a_posteriori(walkers, series.coefficients, [0.7, -0.2], elevation=0.1),
        maximum_a_posteriori(walkers, series.coefficients, 0.7, variance=None, measurement=1e-4),
    ]
    return [series, [[f, f.coefficients] for f in found]]


@output("lifting unknown views by MAP", approach="map")
@output("lifting unknown views by least squares", approach="ls", n_components=5)
@output("lifting unknown views, phase and elevation", phase="unknown", elevation="unknown")
def _unknown(**how) -> Any:
    from motionenv.lifting import find_view, fourier_points

    return find_view(motionenv.load("walk/prior"), fourier_points(points()).coefficients, **how)
