"""From a motion to the frames of a film: from where, how big, drawn as a body or as points of light."""

import os
from collections.abc import Iterator
from typing import cast

import numpy as np

from motionenv.body import markers
from motionenv.errors import GapError, MotionError
from motionenv.render.cameras import fit_view
from motionenv.render.cameras import follow as follow_path
from motionenv.render.engines import ENGINES, render
from motionenv.render.pointlights import render_points
from motionenv.render.raycast import Raycaster
from motionenv.render.scene import Scene
from motionenv.types import Camera, Motion

_CHUNK = 32  # frames drawn at a time
_EASE = 0.5  # [s] how smoothly a camera follows: standard deviation of the low-pass on the walker's path


def film(
    motion: Motion,
    alpha: float = 0.0,
    *,
    width: int = 640,
    height: int = 480,
    points: bool = False,
    engine: str = "raycast",
    follow: bool = True,
    scene: Scene | None = None,
) -> Iterator[np.ndarray]:
    """Frames (height, width, 3) uint8 of a motion, one after the other.

    Args:
        motion: (frames, 25), without gaps.
        alpha: view angle [rad].
        width: of the picture [pixels].
        height: of the picture [pixels].
        points: point lights (paper B, fig. 1) instead of a body.
        engine: "raycast" or "pyrender".
        follow: whether the camera travels with the walker, or stands where it sees the whole walk.
        scene: light, clothes, ground and sky; the default ones, with 2 × 2 rays per pixel, when None.

    Raises:
        GapError: the motion has gaps.
        MotionError: a batch of motions, or no such engine.
        EngineError: the engine can't run here.
    """
    if motion.poses.ndim != 2:
        raise MotionError(
            f"film one motion (frames, 25) at a time, got poses of shape {motion.poses.shape}: take poses[0]"
        )
    if engine not in ENGINES:
        raise MotionError(f"engine must be one of {', '.join(ENGINES)}, got {engine!r}")
    if not np.isfinite(motion.poses).all():
        known = np.isfinite(motion.poses).all(1)
        raise GapError(f"{(~known).sum()} of {len(known)} frames have gaps; cut or fill them before rendering")
    cameras = cameras_for(motion, alpha, width, height, follow=follow)
    return _frames(motion, cameras, points, engine, scene or Scene(samples=2))


def cameras_for(motion: Motion, alpha: float, width: int, height: int, *, follow: bool) -> list[Camera]:
    """One camera per frame, at view angle `alpha` [rad].

    Args:
        motion: (frames, 25).
        alpha: view angle [rad].
        width: of the picture [pixels].
        height: of the picture [pixels].
        follow: whether they travel with the walker.
    """
    seen = markers(motion.poses, motion.skeleton)
    margin = 0.14  # head, hands and feet reach beyond the markers
    if not follow:
        return [fit_view(seen, alpha, width=width, height=height, margin=margin, elevation=0.06)] * len(seen)
    still = seen - motion.poses[:, None, :3] * [1, 1, 0]
    camera = fit_view(still, alpha, width=width, height=height, margin=margin, elevation=0.06)
    return list(follow_path(motion, camera, smooth=_EASE * motion.fps))


def _frames(motion: Motion, cameras: list[Camera], points: bool, engine: str, scene: Scene) -> Iterator[np.ndarray]:
    """Draw in chunks, so that threads have work and memory stays small."""
    raycaster = Raycaster(scene, threads=os.cpu_count() or 1)
    for start in range(0, len(motion.poses), _CHUNK):
        poses, views = motion.poses[start : start + _CHUNK], cameras[start : start + _CHUNK]
        if points:
            yield from render_points(markers(poses, motion.skeleton), views, radius=views[0].height / 90)
        elif engine == "raycast":
            yield from cast(np.ndarray, raycaster.render(poses, motion.skeleton, views).rgb)
        else:
            yield from cast(np.ndarray, render(poses, motion.skeleton, views, scene=scene, engine=engine).rgb)
