"""Base classes of the environments that show images, and their common arguments."""

from collections.abc import Callable, Sequence
from typing import Any

from gymnasium.vector import AutoresetMode

from motionenv.envs.base import TrackingEnv, with_horizon
from motionenv.envs.simulation.estimates import Estimates
from motionenv.envs.simulation.motion_sources import Source, episode_frames
from motionenv.envs.simulation.picture_world import PictureWorld
from motionenv.envs.simulation.stage import Motions, PictureSettings, Stage
from motionenv.envs.simulation.views import View
from motionenv.envs.vector import TrackingVectorEnv
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.render.sensors.augmentation import Augmentation

#: Builds a world of n episodes from an environment's arguments.
MakeWorld = Callable[..., PictureWorld]


class PictureTracking(TrackingEnv):
    """A single environment that shows images; subclasses define the world.

    Args:
        render_mode: None, "rgb_array" or "human".
        lost_after: error [m] beyond which the track counts as lost; None disables it.
        arguments: of the world.
    """

    make_world: MakeWorld
    world: PictureWorld

    def __init__(self, *, render_mode: str | None = None, lost_after: float | None = None, **arguments: Any):
        super().__init__(type(self).make_world(1, **arguments), render_mode=render_mode, lost_after=lost_after)

    @property
    def observation_model(self) -> SilhouetteLikelihood:
        """Likelihood of poses (n, 25) for the last observed frame, without access to the ground truth."""
        self.check_begun("observation")
        return self.world.observation_model(0)


class PictureTrackingVector(TrackingVectorEnv):
    """A batch of environments, rendered together; subclasses define the world.

    Args:
        num_envs: number of environments.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, as `gymnasium.vector.AutoresetMode` or its value.
        batch_size: number of environments that `recv` returns, see `motionenv.envs.asynchronous`; None for all.
        threads: rendering threads; None uses one per core.
        render_mode: None or "rgb_array".
        lost_after: error [m] beyond which the track counts as lost; None disables it.
        arguments: of the world.
    """

    make_world: MakeWorld

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        batch_size: int | None = None,
        threads: int | None = None,
        render_mode: str | None = None,
        lost_after: float | None = None,
        **arguments: Any,
    ):
        super().__init__(
            type(self).make_world(num_envs, threads=threads, **with_horizon(arguments)),
            render_mode=render_mode,
            lost_after=lost_after,
            autoreset_mode=autoreset_mode,
            batch_size=batch_size,
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
    actions: str = "normalised",
    file_fps: float | None = None,
    unit: str | None = None,
    threads: int | None = 1,
) -> PictureWorld:
    """People, each in front of their own camera.

    Args:
        n: number of episodes.
        direct: makes the motion and the view from the source of motion and `camera`.
        motion, motion_seed: source of motion, see `motionenv.envs.WalkerTracking`.
        scored: scored pose entries and joints, arguments of `Estimates`.
        split, size, observation, camera, background, distractors, occluders, noise, brightness, fps, horizon: see
            `motionenv.envs.WalkerTracking`.
        speed, height, clothes, estimate, n_belief, actions, file_fps, unit: see `motionenv.envs.WalkerTracking`.
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
