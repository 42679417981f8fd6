"""Remake the README's pictures in this folder, from the models that ship: `python renders/figures.py [--out DIR]`.

Needs matplotlib: the `plots` extra.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
from plotting import coefficient_histograms, components, frame_and_truth, pose_samples, trajectories, variance_curve

from motionenv import load, write_video
from motionenv.body import markers
from motionenv.envs.agents import Blob, Oracle, TrackingAgent, truth_start
from motionenv.lifting import lift, project_markers
from motionenv.lifting.plot import lifted_walk
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.models.synthesis import synthesize
from motionenv.models.walking.model import WalkingModel
from motionenv.render import Scene, render
from motionenv.render.cameras import fit_view, follow, view
from motionenv.render.draw2d.overlay import side_by_side
from motionenv.render.draw2d.point_lights import render_points
from motionenv.render.raycast.multi_body import outfits
from motionenv.render.request import enlarged
from motionenv.render.video.encode import write_image
from motionenv.render.video.tracking_film import track_film
from motionenv.tracking import FPCAPrior, ParticleFilter, Start
from motionenv.types import ANGLES, MARKERS, POSE, Markers, Motion, Points

HERE = Path(__file__).parent
FPS, SIZE = 25, 320
_DARK = ((0.15, 0.16, 0.22), (0.3, 0.25, 0.2), (0.22, 0.22, 0.24), (0.13, 0.2, 0.3))  # trousers
_CHILDREN = (4, 11)  # of twelve
BETAS = (0.002, 0.05, 0.2, 1.0)


def one_cycle(model: WalkingModel, seed: int, speed: float) -> Motion:
    """A walk that ends where its cycle began, so that a video of it has no seam."""
    somebody = model.draw_walker(np.random.default_rng(seed), speed)
    frames = round(FPS * somebody.stride_seconds)
    return model.synthesize(frames / FPS, frames / somebody.stride_seconds, walker=somebody, seed=seed, variation=0)


def walker(out: Path) -> None:
    """walk.webp: a person beside its point-light twin."""
    motion = one_cycle(load("walk/fpca"), seed=10, speed=1.3)
    placed = view(np.radians(35), distance=3.3, eye_height=1.3, target=(0, 0, 0.93), width=SIZE, height=SIZE)
    views = follow(motion, placed)
    way = np.linalg.norm((views[-1].centre - views[0].centre)[:2]) * len(views) / (len(views) - 1)
    # Two tiles along the way of one cycle: then the ground has no seam either.
    bodies = render(motion.poses, motion.skeleton, views, scene=Scene(samples=3, tile=way / 2)).rgb
    dots = render_points(markers(motion.poses, motion.skeleton), views, radius=4)
    write_video(out / "walk.webp", side_by_side(bodies, dots), FPS)


def twelve(out: Path) -> None:
    """twelve.webp: a dozen drawn people on a common way, each with steps of their own; without a seam."""
    model, frames, way = load("walk/fpca"), 4 * FPS, 5.6
    rng = np.random.default_rng(12)
    camera = view(
        np.radians(62), distance=7.2, eye_height=1.9, target=(0, 0, 0.8), width=640, height=260, fov_degrees=34
    )
    moved = [replace(camera, t=camera.t - camera.R @ (way * i / frames, 0, 0)) for i in range(frames)]
    pictures = np.full((frames, 260, 640, 3), 255, np.uint8)
    depth = np.full((frames, 260, 640), np.inf, np.float32)
    for i in range(12):
        motion = _going(model, i, way, frames, "child" if i in _CHILDREN else "adult")
        poses = motion.poses.copy()
        row, column = i % 3, i // 3 - 1.5
        poses[:, :2] += 1.8 * (row - 1) + 0.2 * rng.standard_normal(), 1.3 * column + 0.45 * (row - 1)
        skin, shirt, _, _, hair = (tuple(colour) for colour in outfits(rng.uniform(0.1, 0.8, (5, 3))))
        clothes = Scene(samples=2, tile=way / 10, skin=skin, shirt=shirt, hair=hair, trousers=_DARK[i % 4])
        seen = render(poses, motion.skeleton, moved, scene=clothes)
        near = seen.depth < depth
        nobody = np.isinf(seen.depth) & np.isinf(depth)
        pictures[near], depth[near] = seen.rgb[near], seen.depth[near]
        pictures[nobody] = np.minimum(pictures, seen.rgb)[nobody]  # everybody's shadow
    write_video(out / "twelve.webp", pictures, FPS)


def _going(model: WalkingModel, seed: int, way: float, frames: int, person: str) -> Motion:
    """Somebody who goes `way` [m] in `frames` with a whole number of strides: at the pace nearest to their own."""
    strides, speed = 0, way * FPS / frames
    for _ in range(8):
        somebody = model.draw_walker(np.random.default_rng(seed), speed, person=person)
        length = speed * somebody.stride_seconds
        strides = strides or round(way / length)
        speed *= (way / strides / length) ** 2  # a stride's length grows with the root of speed
    seconds = strides * somebody.stride_seconds
    motion = model.synthesize(seconds, frames / seconds, walker=somebody, seed=seed, phase=seed / 5 % 1, variation=0)
    poses = motion.poses.copy()  # people veer by a degree or two: who comes back to the start of the film must not
    veer = np.arctan2(*(poses[-1, 1::-1] - poses[0, 1::-1]))
    turn = np.array(((np.cos(veer), -np.sin(veer)), (np.sin(veer), np.cos(veer))))
    poses[:, :2] = poses[:, :2] @ turn
    poses[:, POSE.index("root_heading")] -= veer
    return replace(motion, poses=poses)


def figures(out: Path) -> None:
    """papers/components.png (paper A, figs. 9 and 10) and papers/variance.png (paper B, fig. 2)."""
    fpca = load("walk/fpca").fpca_
    phase = np.arange(100) / 100
    mean = fpca.evaluate(np.zeros(fpca.n_components), phase)
    steps = np.diag(2 * np.sqrt(fpca.explained_variance_))
    modes = fpca.evaluate(steps[:, None], phase) - mean
    shown = components(mean[:, :19], modes[..., :19], ANGLES, show=("left_hip_flexion", "left_knee_flexion"), count=3)
    shown.savefig(out / "papers" / "components.png", dpi=90)
    shares = load("walk/eigenwalkers").explained_variance_ratio_
    variance_curve(shares, marked=5).savefig(out / "papers" / "variance.png", dpi=90)


def tree(out: Path) -> None:
    """papers/samples.png, coefficients.png and trajectories.png (paper C, figs. 3, 4 and 5), from `mixed/tree`."""
    model = load("mixed/tree")
    history = load("walk/fpca").synthesize(2, 30, seed=10, speed=1.3)
    drawn = [model.sample(history, 10, temperature=beta, seed=0, method="exact").poses for beta in BETAS]
    titles = [f"β = {beta:g}" for beta in BETAS]
    pose_samples(history.poses[-1], drawn, history.skeleton, titles).savefig(out / "papers" / "samples.png", dpi=90)
    draws = {}
    for method in ("exact", "tree"):
        found = model.sample(history, 1000, temperature=1.0, seed=0, method=method)
        draws[method] = model.index_.coefficients(found.windows)
    probe = model.coefficients(history)
    coefficient_histograms(draws, probe, 1.0).savefig(out / "papers" / "coefficients.png", dpi=90)
    trajectories(model.generator("brisk walk", seed=3).motion(2)).savefig(out / "papers" / "trajectories.png", dpi=90)


def tracking(out: Path) -> None:
    """environments/walker.png: what WalkerTracking shows, in three kinds of episodes, one row each."""
    rows = []
    for settings in (
        {"camera": "side"},
        {"camera": "follow", "background": "clutter", "noise": 6.0},
        {"camera": "random", "background": "clutter", "occluders": 1, "distractors": 1},
    ):
        with gymnasium.make("motionenv/WalkerTracking-v1", size=128, horizon=80, actions="metric", **settings) as env:
            pictures = [env.reset(seed=15)[0]]
            for _ in range(75):
                pictures.append(env.step(env.unwrapped.truth()["pose"].astype(np.float32))[0])
        rows.append(np.concatenate(pictures[::25], axis=1))
    write_image(out / "environments" / "walker.png", np.concatenate(rows))


def lifting(out: Path) -> None:
    """lifted.png: a synthesised walker from noisy points with gaps, one wrist never seen."""
    motion = synthesize("walk/fpca", 4, 30, seed=7)
    walk = Markers(MARKERS, markers(motion.poses, motion.skeleton), motion.fps)
    seen = project_markers(walk, np.radians(40))
    rng = np.random.default_rng(1)
    positions = seen.positions + 0.01 * rng.standard_normal(seen.positions.shape)
    positions[rng.random(positions.shape[:2]) < 0.2] = np.nan
    positions[:, MARKERS.index("right_wrist")] = np.nan
    lifted_walk(lift(Points(positions, seen.fps, "m", seen.truth))).savefig(out / "lifted.png", dpi=64)


def track(out: Path) -> None:
    """track.png: a particle filter follows a walker through clutter, first pose and body given; two frames."""
    with gymnasium.make(
        "motionenv/WalkerTracking-v1", size=128, observation=("mask", "rgb"), background="clutter", horizon=75,
        actions="metric",
    ) as env:  # fmt: skip
        seen, _ = env.reset(seed=21)
        truth = env.unwrapped.truth()
        camera, body = truth["camera"], truth["skeleton"]
        tracker = ParticleFilter(FPCAPrior(skeleton=body), SilhouetteLikelihood(camera, body), n=1000, seed=1)
        tracker.start(Start.at(truth["pose"]))
        pictures, beliefs, errors = [], [], []
        for _ in range(75):
            beliefs.append(tracker.step(mask=seen["mask"][..., 0]))
            pictures.append(seen["rgb"].repeat(2, axis=0).repeat(2, axis=1))
            seen, _, _, _, info = env.step(beliefs[-1].mean.astype(np.float32))
            errors.append(1000 * info["error"])
    poses, particles = np.array([b.mean for b in beliefs]), np.array([b.poses[::33] for b in beliefs])
    film = list(track_film(pictures, enlarged(camera, 2), poses, particles, body, errors, label="error per joint [mm]"))
    write_image(out / "track.png", np.concatenate([film[i] for i in (14, 74)], axis=1))


def other_environments(out: Path) -> None:
    """environments/arm.png, markers.png: five moments of ArmTracking and MarkerTracking, the truth drawn over them."""
    for name, file, settings in (("ArmTracking", "arm", {"size": 128}), ("MarkerTracking", "markers", {})):
        with gymnasium.make(f"motionenv/{name}-v1", render_mode="rgb_array", **settings) as env:
            agent = Oracle(env)
            seen, _ = env.reset(seed=5)
            agent.reset(seen)
            pictures = []
            for _ in range(60):
                seen, *_ = env.step(agent.act(seen))
                pictures.append(env.render())
        write_image(out / "environments" / f"{file}.png", np.concatenate(pictures[5::11], axis=1))


def first_picture(out: Path) -> None:
    """start/picture.png: a frame of a walk as the guide's first page renders it."""
    walk = synthesize("walk/fpca", 4, 30, seed=7)
    points = markers(walk.poses, walk.skeleton)
    camera = fit_view(points[66:67], alpha=np.radians(40), width=240, height=320)
    frame = render(walk.poses[66], walk.skeleton, camera)
    pixels, _ = camera.project(points[66])
    frame_and_truth(frame, pixels).savefig(out / "start" / "picture.png", dpi=80)


def first_environment(out: Path) -> None:
    """start/environment.png: six frames of an episode, with the estimates of two agents drawn over them."""
    rows = []
    for kind in ("blob", "filter"):
        with gymnasium.make("motionenv/WalkerTracking-Easy-v1", render_mode="rgb_array") as env:
            agent = Blob(env) if kind == "blob" else TrackingAgent(env, n=300, start=truth_start, seed=1)
            seen, _ = env.reset(seed=7)
            agent.reset(seen)
            pictures = []
            for _ in range(env.spec.max_episode_steps):
                seen, *_ = env.step(agent.act(seen))
                pictures.append(env.render()[75:195, 150:240].repeat(2, axis=0).repeat(2, axis=1))  # where the body is
            rows.append(np.concatenate(pictures[3:31:5], axis=1))
    write_image(out / "start" / "environment.png", np.concatenate(rows))


def main() -> None:
    """Make them all."""
    parser = argparse.ArgumentParser(description="Remake the README's pictures.")
    parser.add_argument("--out", type=Path, default=HERE, help="folder to write to")
    out = parser.parse_args().out
    for folder in ("environments", "papers", "start"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    walker(out)
    twelve(out)
    figures(out)
    tree(out)
    tracking(out)
    lifting(out)
    track(out)
    other_environments(out)
    first_picture(out)
    first_environment(out)


if __name__ == "__main__":
    main()
