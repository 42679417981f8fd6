"""From a motion to the frames of a film: from where, how big, drawn as a body or as points of light."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from motionenv.body import markers
from motionenv.errors import GapError, MotionError
from motionenv.render.cameras import fit_view
from motionenv.render.cameras import follow as follow_path
from motionenv.render.engines import ENGINES, render
from motionenv.render.pointlights import render_points
from motionenv.render.raycast import Raycaster
from motionenv.render.scene import Colour, Scene
from motionenv.types import Camera, Motion

_CHUNK = 32  # frames drawn at a time, at most
_PIXELS = 32 * 640 * 480  # that they have at most, so that who stops a film doesn't wait long
_BEGIN = 8  # frames drawn at first, so that a film begins at once
_LEVEL = 0.06  # [rad] by which cameras look down unless told otherwise
_PLAIN = (0.0, 0.0, 0.0)  # behind point lights
_EASE = 0.5  # [s] how smoothly a camera follows: standard deviation of the low-pass on the walker's path


def film(
    motion: Motion,
    alpha: float = 0.0,
    *,
    width: int = 640,
    height: int = 480,
    elevation: float = _LEVEL,
    points: bool = False,
    colour: Colour = (1.0, 1.0, 1.0),
    background: Colour | None = None,
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
        elevation: angle [rad] by which the camera looks down, within ±π/2.
        points: point lights (paper B, fig. 1) instead of a body.
        colour: (red, green, blue; 0 to 1) of the point lights.
        background: one colour (red, green, blue; 0 to 1) instead of ground and sky, or of the black behind the points.
        engine: "raycast" or "pyrender".
        follow: whether the camera travels with the walker, or stands where it sees the whole walk.
        scene: light, clothes, ground and sky; the default ones, with 2 × 2 rays per pixel, when None.

    Raises:
        GapError: the motion has gaps.
        MotionError: a batch of motions, or no such engine, a colour or an elevation out of range.
        EngineError: the engine can't run here.
    """
    cameras, draw = _prepared(
        motion, alpha, width, height, elevation, points, colour, background, engine, follow, scene
    )
    return _frames(motion, cameras, draw)


def picture(motion: Motion, frame: int, alpha: float = 0.0, *, width: int = 640, height: int = 480,
            elevation: float = _LEVEL, points: bool = False, colour: Colour = (1.0, 1.0, 1.0),
            background: Colour | None = None, engine: str = "raycast", follow: bool = True,
            scene: Scene | None = None) -> np.ndarray:  # fmt: skip
    """One frame (height, width, 3) uint8 of the `film` with the same arguments, without drawing the others.

    Args:
        motion: (frames, 25).
        frame: which of them.
        alpha, width, height, elevation, points, colour, background, engine, follow, scene: as of `film`.

    Raises:
        MotionError: as `film`, or there is no such frame.
    """
    if not 0 <= frame < len(motion.poses):
        raise MotionError(f"the motion has frames 0 to {len(motion.poses) - 1}, got {frame!r}")
    cameras, draw = _prepared(
        motion, alpha, width, height, elevation, points, colour, background, engine, follow, scene
    )
    return draw(motion.poses[frame : frame + 1], cameras[frame : frame + 1])[0]


def cameras_for(
    motion: Motion, alpha: float, width: int, height: int, *, follow: bool, elevation: float = _LEVEL
) -> list[Camera]:
    """One camera per frame, at view angle `alpha` [rad].

    Args:
        motion: (frames, 25).
        alpha: view angle [rad].
        width: of the picture [pixels].
        height: of the picture [pixels].
        follow: whether they travel with the walker.
        elevation: angle [rad] by which they look down.
    """
    seen = markers(motion.poses, motion.skeleton)
    margin = 0.14  # head, hands and feet reach beyond the markers
    if not follow:
        return [fit_view(seen, alpha, width=width, height=height, margin=margin, elevation=elevation)] * len(seen)
    still = seen - motion.poses[:, None, :3] * [1, 1, 0]
    camera = fit_view(still, alpha, width=width, height=height, margin=margin, elevation=elevation)
    return list(follow_path(motion, camera, smooth=_EASE * motion.fps))


Draw = Callable[[np.ndarray, Sequence[Camera]], np.ndarray]


def _prepared(
    motion, alpha, width, height, elevation, points, colour, background, engine, follow, scene
) -> tuple[list[Camera], Draw]:
    """A camera per frame, and what draws poses (n, 25) seen by n of them.

    Raises:
        MotionError: what `film` raises.
    """
    if motion.poses.ndim != 2:
        raise MotionError(
            f"film one motion (frames, 25) at a time, got poses of shape {motion.poses.shape}: take poses[0]"
        )
    if engine not in ENGINES:
        raise MotionError(f"engine must be one of {', '.join(ENGINES)}, got {engine!r}")
    for name, value in (("colour", colour), ("background", background)):
        if value is not None and not (len(value) == 3 and all(0 <= c <= 1 for c in value)):
            raise MotionError(f"{name} must be (red, green, blue) from 0 to 1, got {value!r}")
    if not np.isfinite(motion.poses).all():
        known = np.isfinite(motion.poses).all(1)
        raise GapError(f"{(~known).sum()} of {len(known)} frames have gaps; cut or fill them before rendering")
    cameras = cameras_for(motion, alpha, width, height, follow=follow, elevation=elevation)
    if points:
        return cameras, _of_points(motion, colour, background or _PLAIN, cameras[0].height / 90)
    scene = scene or Scene(samples=2)
    if background is not None:
        scene = replace(scene, ground=False, horizon=tuple(background), zenith=tuple(background))
    return cameras, _of_body(motion, engine, scene)


def _of_points(motion: Motion, colour: Colour, background: Colour, radius: float) -> Draw:
    """Draws dots of `radius` [pixels]."""
    dots, behind = (np.round(np.multiply(c, 255)) for c in (colour, background))

    def draw(poses: np.ndarray, cameras: Sequence[Camera]) -> np.ndarray:
        seen = markers(poses, motion.skeleton)
        return render_points(seen, cameras, radius=radius, colour=dots, background=behind)

    return draw


def _of_body(motion: Motion, engine: str, scene: Scene) -> Draw:
    """Draws the body by an engine."""
    if engine == "raycast":
        raycaster = Raycaster(scene, threads=os.cpu_count() or 1)
        return lambda poses, cameras: cast(np.ndarray, raycaster.render(poses, motion.skeleton, cameras).rgb)
    return lambda poses, cameras: cast(
        np.ndarray, render(poses, motion.skeleton, cameras, scene=scene, engine=engine).rgb
    )


def _frames(motion: Motion, cameras: list[Camera], draw: Draw) -> Iterator[np.ndarray]:
    """Draw in chunks, so that threads have work and memory stays small."""
    most = max(1, min(_CHUNK, _PIXELS // (cameras[0].width * cameras[0].height)))
    start, count = 0, min(most, _BEGIN)
    while start < len(motion.poses):
        yield from draw(motion.poses[start : start + count], cameras[start : start + count])
        start, count = start + count, most
