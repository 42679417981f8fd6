"""What the environments that show pictures share: how they are made, and the arguments that they take."""

import os
from collections.abc import Callable, Sequence
from typing import Any

from gymnasium.vector import AutoresetMode

from motionenv.envs.base import TrackingEnv
from motionenv.envs.estimates import Estimates
from motionenv.envs.sources import Source, episode_frames
from motionenv.envs.stage import Motions, Sense, Stage
from motionenv.envs.vector import TrackingVectorEnv
from motionenv.envs.views import View
from motionenv.envs.world import PictureWorld
from motionenv.estimation import ObservationModel
from motionenv.render.scenery import SceneryChoice

#: Makes a world of n episodes from an environment's arguments.
MakeWorld = Callable[..., PictureWorld]


class PictureTracking(TrackingEnv):
    """A single environment that shows pictures; subclasses say which world.

    Args:
        render_mode: None, "rgb_array" or "human".
        lost_after: error [m] beyond which the track counts as lost; None for never.
        arguments: of the world.
    """

    make_world: MakeWorld
    world: PictureWorld

    def __init__(self, *, render_mode: str | None = None, lost_after: float | None = None, **arguments: Any):
        super().__init__(type(self).make_world(1, **arguments), render_mode=render_mode, lost_after=lost_after)

    @property
    def observation_model(self) -> ObservationModel:
        """Scores thousands of poses (n, 25) against the frame observed last, without the truth."""
        self.check_begun("observation")
        return self.world.observation_model(0)


class PictureTrackingVector(TrackingVectorEnv):
    """Many of a single environment, drawn together; subclasses say which world.

    Args:
        num_envs: how many.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, as `gymnasium.vector.AutoresetMode` or its value.
        threads: that draw; None is as many as there are cores.
        render_mode: None or "rgb_array".
        lost_after: error [m] beyond which the track counts as lost; None for never.
        arguments: of the world.
    """

    make_world: MakeWorld

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        render_mode: str | None = None,
        lost_after: float | None = None,
        **arguments: Any,
    ):
        threads = (os.cpu_count() or 1) if threads is None else threads
        super().__init__(
            type(self).make_world(num_envs, threads=threads, **arguments),
            render_mode=render_mode,
            lost_after=lost_after,
            autoreset_mode=autoreset_mode,
        )


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
    file_fps: float | None = None,
    unit: str | None = None,
    threads: int = 1,
) -> PictureWorld:
    """People, each before a camera of his own.

    Args:
        n: how many.
        direct: what moves and whence it is seen, from the source of motion and `camera`.
        motion, motion_seed: whence motion comes, see `motionenv.envs.WalkerTracking`.
        scored: which entries and joints an estimate is of, as `Estimates` takes them.
        split, size, observation, camera, background, distractors, occluders, noise, brightness, fps, horizon: see
            `motionenv.envs.WalkerTracking`.
        speed, height, clothes, estimate, n_belief, file_fps, unit: see `motionenv.envs.WalkerTracking`.
        threads: that draw.

    Raises:
        MotionError: an impossible argument; names it.
    """
    sense, estimates = Sense(observation, size), Estimates(estimate, n_belief, threads=threads, **scored)
    scenery = SceneryChoice(background, distractors, occluders, noise, brightness)
    source = Source(motion, split, episode_frames(horizon), fps, speed, height, file_fps, unit, motion_seed)
    motions, view = direct(source, camera)
    stage = Stage(n, motions, view, size=size, scenery=scenery, clothes=clothes, threads=threads)
    return PictureWorld(stage, sense, estimates)
