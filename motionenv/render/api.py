"""The `render` function, common to both engines."""

from collections.abc import Sequence

import numpy as np

from motionenv._core.validation import checked_choice
from motionenv.render.raycast.engine import Raycaster
from motionenv.render.scene import Scene
from motionenv.types import Camera, Frame, Skeleton

#: Allowed values of `engine`.
ENGINES = ("raycast", "pyrender")


def render(
    poses: np.ndarray, skeleton: Skeleton, cameras: Camera | Sequence[Camera], *, scene: Scene | None = None,
    rgb: bool = True, engine: str = "raycast",
) -> Frame:  # fmt: skip
    """Render a body in poses.

    Poses and cameras broadcast like NumPy arrays: one camera serves all poses; n cameras are matched with the last
    batch axis, so that (n, 25) poses are seen by one camera each, and one (25,) pose is seen n times.

    Args:
        poses: (..., 25) [m, rad]; limbs whose angles are NaN are not drawn (`motionenv.body.gaps.known_limbs`).
        skeleton: the body.
        cameras: one `Camera`, or a sequence of them, all of one image size.
        scene: light, clothes, ground and sky; None uses the defaults.
        rgb: whether to render colours too.
        engine: "raycast" (exact, fast, needs no graphics library) or "pyrender" (OpenGL).

    Returns:
        Images (..., height, width): rgb, depth [m] and limb ids. Use a `Raycaster` for several threads.

    Raises:
        MotionError: a pose has infinite values, shapes don't broadcast, or there is no such engine.
        EngineError: pyrender can't run here; the message says what to install.
    """
    checked_choice(engine, "engine", ENGINES)
    if engine == "pyrender":
        from motionenv.render.opengl.engine import shared_renderer

        return shared_renderer(scene).render(poses, skeleton, cameras, rgb=rgb)
    return Raycaster(scene).render(poses, skeleton, cameras, rgb=rgb)
