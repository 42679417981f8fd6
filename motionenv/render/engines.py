"""One call for both engines."""

from collections.abc import Sequence

from motionenv.errors import MotionError
from motionenv.render.raycast import Raycaster
from motionenv.render.scene import Scene
from motionenv.types import Camera, Frame, Skeleton

#: Names for `render`'s `engine`.
ENGINES = ("raycast", "pyrender")


def render(
    poses,
    skeleton: Skeleton,
    cameras: Camera | Sequence[Camera],
    *,
    scene: Scene | None = None,
    rgb: bool = True,
    engine: str = "raycast",
) -> Frame:
    """Draw a body in poses.

    Poses and cameras broadcast like NumPy arrays: one camera serves all poses; n cameras go with the last batch
    axis, so that (n, 25) poses are seen by one camera each, and one (25,) pose is seen n times.

    Args:
        poses: (..., 25) [m, rad].
        skeleton: the body.
        cameras: one `Camera`, or a sequence of them, all of one picture size.
        scene: light, clothes, ground and sky; the default ones when None.
        rgb: whether to draw colours too.
        engine: "raycast" (exact, fast, needs no graphics library) or "pyrender" (OpenGL).

    Returns:
        Pictures (..., height, width): rgb, depth [m] and limb ids. Call a `Raycaster` itself for threads.

    Raises:
        MotionError: a pose isn't finite, shapes don't go together, or there is no such engine.
        EngineError: pyrender can't run here; says what to install.
    """
    if engine not in ENGINES:
        raise MotionError(f"engine must be one of {', '.join(ENGINES)}, got {engine!r}")
    if engine == "pyrender":
        from motionenv.render.pyrender_engine import shared_renderer

        return shared_renderer(scene).render(poses, skeleton, cameras, rgb=rgb)
    return Raycaster(scene).render(poses, skeleton, cameras, rgb=rgb)
