"""Render the frames of a film from a motion: camera, size, body or point lights."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from motionenv.body.kinematics import shown_markers
from motionenv.errors import GapError, MotionError
from motionenv.render.cameras import fit_view
from motionenv.render.cameras import follow as follow_path
from motionenv.render.draw2d.point_lights import render_points
from motionenv.render.raycast.engine import Raycaster
from motionenv.render.scene import Colour, Scene
from motionenv.types import Camera, Motion

_CHUNK = 32  # most frames rendered in one batch
_PIXELS = 32 * 640 * 480  # most pixels of a batch, so that a film can be stopped quickly
_BEGIN = 8  # frames of the first batch, so that a film starts quickly
_LEVEL = 0.06  # [rad] default elevation of cameras
_PLAIN = (0.0, 0.0, 0.0)  # background of point lights
_EASE = 0.5  # [s] standard deviation of the low-pass filter of a following camera's path


def film(
    motion: Motion, alpha: float = 0.0, *, width: int = 640, height: int = 480, elevation: float = _LEVEL,
    points: bool = False, colour: Colour = (1.0, 1.0, 1.0), background: Colour | None = None,
    follow: bool = True, scene: Scene | None = None,
) -> Iterator[np.ndarray]:  # fmt: skip
    """Frames (height, width, 3) uint8 of a motion, one at a time.

    Args:
        motion: (frames, 25), NaN where unknown: limbs are drawn in the frames in which they are known.
        alpha, elevation: view angle, and angle by which the camera looks down, within ±π/2 [rad].
        width, height: of the image [pixels].
        points: point lights (paper B, fig. 1) instead of a body.
        colour: (red, green, blue; 0 to 1) of the point lights.
        background: one colour (red, green, blue; 0 to 1) instead of ground and sky, or of the black behind the points.
        follow: whether the camera follows the walker, or is static and shows the whole walk.
        scene: light, clothes, ground and sky; None uses the defaults with 2 × 2 rays per pixel.

    Raises:
        GapError: the root is never known.
        MotionError: a batch of motions, or a colour or an elevation out of range.
    """
    cameras, draw = _prepared(motion, alpha, width, height, elevation, points, colour, background, follow, scene)
    return _frames(motion, cameras, draw)


def picture(motion: Motion, frame: int, alpha: float = 0.0, *, width: int = 640, height: int = 480,
            elevation: float = _LEVEL, points: bool = False, colour: Colour = (1.0, 1.0, 1.0),
            background: Colour | None = None, follow: bool = True,
            scene: Scene | None = None) -> np.ndarray:  # fmt: skip
    """The `frame` (height, width, 3) uint8 of the `film` with the same arguments, without rendering the others.

    Args:
        motion, alpha, width, height, elevation, points, colour, background, follow, scene: as in `film`.
        frame: frame index; a `MotionError` if there is no such frame, or as in `film`.
    """
    if not 0 <= frame < len(motion.poses):
        raise MotionError(f"frame must be from 0 to {len(motion.poses) - 1}, got {frame!r}")
    cameras, draw = _prepared(motion, alpha, width, height, elevation, points, colour, background, follow, scene)
    return draw(motion.poses[frame : frame + 1], cameras[frame : frame + 1])[0]


def cameras_for(
    motion: Motion, alpha: float, width: int, height: int, *, follow: bool, elevation: float = _LEVEL
) -> list[Camera]:
    """One camera per frame of a `motion` (frames, 25) at view angle `alpha` [rad], which may `follow` the walker.

    It looks down by the angle `elevation` [rad] and has images of `width` and `height` [pixels].
    """
    seen = shown_markers(motion.poses, motion.skeleton)
    margin = 0.14  # head, hands and feet extend beyond the markers
    if not follow:
        return [fit_view(seen, alpha, width=width, height=height, margin=margin, elevation=elevation)] * len(seen)
    still = seen - motion.poses[:, None, :3] * [1, 1, 0]
    camera = fit_view(still, alpha, width=width, height=height, margin=margin, elevation=elevation)
    return list(follow_path(motion, camera, smooth=_EASE * motion.fps))


Draw = Callable[[np.ndarray, Sequence[Camera]], np.ndarray]


def _prepared(
    motion, alpha, width, height, elevation, points, colour, background, follow, scene
) -> tuple[list[Camera], Draw]:
    """A camera per frame, and the function that renders poses (n, 25) from n of them."""
    if motion.poses.ndim != 2:
        raise MotionError(f"motion must be one motion (frames, 25), got poses of {motion.poses.shape}: use poses[0]")
    for name, value in (("colour", colour), ("background", background)):
        if value is not None and not (len(value) == 3 and all(0 <= c <= 1 for c in value)):
            raise MotionError(f"{name} must be (red, green, blue) from 0 to 1, got {value!r}")
    if not np.isfinite(motion.poses[:, :6]).all(axis=1).any():
        raise GapError(f"{motion.name or 'the motion'} has no frame with a known root, so there is nothing to draw")
    cameras = cameras_for(motion, alpha, width, height, follow=follow, elevation=elevation)
    if points:
        return cameras, _of_points(motion, colour, background or _PLAIN, cameras[0].height / 90)
    scene = scene or Scene(samples=2)
    if background is not None:
        scene = replace(scene, ground=False, horizon=tuple(background), zenith=tuple(background))
    return cameras, _of_body(motion, scene)


def _of_points(motion: Motion, colour: Colour, background: Colour, radius: float) -> Draw:
    """Renders dots of `radius` [pixels]."""
    dots, behind = (np.round(np.multiply(c, 255)) for c in (colour, background))
    return lambda poses, cameras: render_points(
        shown_markers(poses, motion.skeleton), cameras, radius=radius, colour=dots, background=behind
    )


def _of_body(motion: Motion, scene: Scene) -> Draw:
    raycaster = Raycaster(scene, threads=None)
    return lambda poses, cameras: cast(np.ndarray, raycaster.render(poses, motion.skeleton, cameras).rgb)


def _frames(motion: Motion, cameras: list[Camera], draw: Draw) -> Iterator[np.ndarray]:
    """Render in batches, so that threads are busy and memory stays small."""
    most = max(1, min(_CHUNK, _PIXELS // (cameras[0].width * cameras[0].height)))
    start, count = 0, min(most, _BEGIN)
    while start < len(motion.poses):
        yield from draw(motion.poses[start : start + count], cameras[start : start + count])
        start, count = start + count, most
