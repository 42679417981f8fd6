"""Outputs of rendering, video and sensors."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import motionenv
from benchmarks.outputs.cases import camera, output, walk


@output("picture from the side", 0.0)
@output("picture from ahead, no ground", 1.57, ground=False)
@output("picture from behind, supersampled", -2.0, samples=2, shadows=False)
def _picture(alpha: float, **scene) -> Any:
    from motionenv.render import render

    motion = walk()
    return render(motion.poses[:20:6], motion.skeleton, camera(alpha, 96), scene=motionenv.Scene(**scene))


@output("picture through cameras that differ")
def _cameras() -> Any:
    from motionenv.render import Raycaster
    from motionenv.render.cameras import follow, look_at

    motion = walk()
    seen = motionenv.markers(motion.poses, motion.skeleton)
    fitted = motionenv.fit_view(seen, 0.7, width=90, height=70, elevation=0.2)
    path = follow(motion.poses[:, :3], fitted, smooth=0.5)
    above = look_at((2, 2, 3), (0, 0, 1), width=90, height=70)
    drawn = Raycaster(threads=2).render(motion.poses[:3], motion.skeleton, [fitted, above, path[5]])
    return [drawn, path, fitted.project(seen)]


@output("crowd plain")
@output("crowd in scenery", background="clutter", distractors=2, occluders=2, noise=5.0, brightness=0.3)
@output("crowd behind things, noise", occluders=3, noise=2.0)
def _crowd(**choice) -> Any:
    from motionenv.render.raycast.multi_body import MultiBodyRaycaster
    from motionenv.render.sensors.augmentation import Augmentation, Augmenter

    rng, n, size = np.random.default_rng(3), 6, 48
    bodies = [motionenv.from_height(height) for height in rng.uniform(1.4, 2.0, n)]
    shapes = [np.array([getattr(body, name) for body in bodies]) for name in ("offsets", "radii", "height")]
    cameras = [camera(alpha, size) for alpha in rng.uniform(-3, 3, n)]
    views = [np.array([getattr(one, name) for one in cameras]) for name in ("K", "R", "t")]
    frame = MultiBodyRaycaster(size, size, threads=2).render(
        walk().poses[:n], *shapes, rng.uniform(0, 1, (n, 4, 3)), *views
    )
    if not choice:
        return frame
    around = Augmenter(Augmentation(**choice), n, size, size)
    for slot in range(n):
        around.begin(slot, np.random.default_rng(slot))
    return around.compose(frame, np.arange(n) * 3.0, np.linspace(-40, 60, n), np.arange(n))


@output("film of a body", 0.7)
@output("film of a body that walks past", 0.0, follow=False, elevation=0.2)
@output("film of points", 0.7, points=True, colour=(0.0, 1.0, 0.2))
def _film(alpha: float, **how) -> Any:
    frames = motionenv.film(walk(), alpha, width=64, height=48, **how)
    return [frame.copy() for _, frame in zip(range(8), frames, strict=False)]


@output("point lights, figures and strips")
def _points() -> Any:
    from motionenv.render.cameras import Orthographic
    from motionenv.render.draw2d.overlay import draw_pose, side_by_side, strip
    from motionenv.render.draw2d.point_lights import render_points

    seen = motionenv.markers(walk().poses[:6], walk().skeleton)
    dots = render_points(seen, camera(), radius=2.0)
    lines = render_points(seen, Orthographic(0.4, 30.0, width=64, height=64), lines=True)
    return [dots, lines, draw_pose(dots[0], seen[0], camera()), side_by_side(dots[0], lines[0]), strip(list(dots), 3)]


@output("marker sensor", None)
@output("marker sensor, perspective", 4.0)
def _sensor(distance: float | None) -> Any:
    from motionenv.render.sensors.marker_sensor import MarkerSensor

    view = MarkerSensor(noise=0.01, dropout=0.1, gaps=0.1, gap_seconds=0.3, distance=distance, fps=30.0).view(4)
    walkers, slots = motionenv.markers(walk().poses[:4], walk().skeleton), np.arange(4)
    seen = []
    for time in range(5):
        view.look(slots, walkers, np.linspace(-1, 2, 4), slots.astype(np.uint64), np.full(4, time))
        seen.append([view.points.copy(), view.seen.copy(), view.joints.copy()])
    return seen


@output("video MP4", "mp4")
@output("video GIF", "gif")
@output("video WebP", "webp")
@output("video as a stream")
def _video(suffix: str | None = None) -> Any:
    frames = motionenv.film(walk(0.5), 0.7, width=64, height=48)
    if suffix is None:
        return b"".join(motionenv.stream_video(frames, 30))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"walk.{suffix}"
        motionenv.write_video(path, frames, 30)
        return path.read_bytes()
