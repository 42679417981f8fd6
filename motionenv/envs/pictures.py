"""The common arguments of the environments that show images."""

from collections.abc import Callable, Sequence
from typing import Any

from motionenv.envs.simulation.estimates import Estimates
from motionenv.envs.simulation.motion_sources import Source, episode_frames
from motionenv.envs.simulation.picture_world import PictureWorld
from motionenv.envs.simulation.stage import Motions, PictureSettings, Stage
from motionenv.envs.simulation.views import View
from motionenv.render.sensors.augmentation import Augmentation


def picture_world(
    n: int,
    direct: Callable[[Source, str | float], tuple[Motions, View]],
    *,
    motion: str,
    motion_seed: int | None = None,
    scored: dict[str, Any],
    split: str = "train",
    size: int = 64,
    observation: str | Sequence[str] = "rgb",
    camera: str | float = "side",
    background: str = "plain",
    distractors: int = 0,
    occluders: int = 0,
    noise: float = 0.0,
    brightness: float = 0.0,
    fps: float = 30.0,
    horizon: int = 90,
    speed: tuple[float, float] | None = None,
    height: tuple[float, float] | None = None,
    clothes: bool = True,
    estimate: str = "pose",
    n_belief: int = 64,
    actions: str = "normalised",
    file_fps: float | None = None,
    unit: str | None = None,
    threads: int | None = 1,
) -> PictureWorld:
    """`n` people, each in front of their own camera.

    Args:
        direct: makes the motion and the view from the source of motion and `camera`.
        scored: scored pose entries and joints, arguments of `Estimates`.
        motion, motion_seed, split, size, observation, camera, background, distractors, occluders, noise, brightness,
            fps, horizon, speed, height, clothes, estimate, n_belief, actions, file_fps, unit: see `WalkerTracking`.
        threads: rendering threads.

    Raises:
        MotionError: an invalid argument.
    """
    sense = PictureSettings(observation, size)
    scenery = Augmentation(background, distractors, occluders, noise, brightness)
    source = Source(motion, split, episode_frames(horizon), fps, speed, height, file_fps, unit, motion_seed)
    motions, view = direct(source, camera)
    estimates = Estimates(estimate, n_belief, threads=threads, actions=actions, reach=view.reach, **scored)
    stage = Stage(n, motions, view, size=sense.size, scenery=scenery, clothes=clothes, threads=threads)
    return PictureWorld(stage, sense, estimates)
