"""The world of the image environments, and their common arguments."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces

from motionenv.envs.base import SimulatedArguments, World
from motionenv.envs.simulation.estimates import Estimates
from motionenv.envs.simulation.motion_sources import Source, episode_frames
from motionenv.envs.simulation.stage import PictureSettings, Stage
from motionenv.envs.simulation.views import View
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.render.draw2d.overlay import draw_pose
from motionenv.render.request import enlarged
from motionenv.render.sensors.augmentation import Augmentation

#: Least side of an image of `render` [pixels].
SHOWN = 256


class PictureWorld(World):
    """A `motionenv.envs.World` of people on a `stage` in front of cameras; `sense` is what images are observed.

    The `stage` holds the episodes, `sense` says which images are observed, `estimates` has action space and scoring.
    """

    def __init__(self, stage: Stage, sense: PictureSettings, estimates: Estimates) -> None:
        self.stage, self.estimates, self._sense = stage, estimates, sense
        self.n, self.horizon, self.fps = stage.n, stage.source.frames - 1, stage.source.fps
        self.observation_space: gymnasium.Space = sense.space
        self.scale = estimates.scale
        self.action_space: spaces.Box = self.scale.space
        self.time = stage.time
        self._models: dict[int, SilhouetteLikelihood] = {}
        self._known = np.full((self.n, 2), -1)
        self._episodes = np.zeros(self.n, dtype=np.intp)

    def begin(self, slots: np.ndarray, rngs: Sequence[np.random.Generator]) -> None:
        self.stage.begin(slots, rngs)
        self._episodes[slots] += 1
        farthest = float(np.abs(self.stage.poses[slots, :, :2]).max())
        if farthest > self.scale.reach:
            raise MotionError(
                f"somebody goes {farthest:.1f} m from the origin, and normalised actions reach {self.scale.reach:g} m: "
                'use actions="metric", or a shorter horizon'
            )

    def observe(self, slots: np.ndarray) -> np.ndarray | dict[str, np.ndarray]:
        return self._sense.of(self.stage, slots)

    def judge(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.estimates.judge(actions, self.stage.now(), self.stage.offsets)

    def advance(self, slots: np.ndarray) -> None:
        self.time[slots] += 1

    def truth(self, slot: int) -> dict[str, Any]:
        return self.stage.truth(slot)

    def observation_model(self, slot: int) -> SilhouetteLikelihood:
        """Likelihood of hypotheses for the current observation of `slot`: its mask, else its depth, else its rgb.

        It knows the camera, but neither the ground truth nor the true body, and is updated only when it is accessed.
        """
        if self._known[slot, 0] != self._episodes[slot]:
            still = not self.stage.pan[slot].any()
            self._models[slot] = SilhouetteLikelihood(self.stage.camera(slot), still=still)
        if tuple(self._known[slot]) != (self._episodes[slot], self.time[slot]):
            frame = self.stage.draw(np.array([slot]), rgb=self._sense.rgb)
            blank = self.stage.blank[slot, self.time[slot]]  # then each pixel may be anything
            nothing = {"mask": np.full(frame.limbs.shape[1:], 0.5)}
            self._models[slot].observe(**nothing if blank else self._sense.evidence(frame))
            self._known[slot] = self._episodes[slot], self.time[slot]
        return self._models[slot]

    def render(self, slot: int, estimate: np.ndarray | None) -> np.ndarray:
        only = np.array([slot])
        picture = np.asarray(self.stage.draw(only, back=0 if estimate is None else 1).rgb)[0]
        finer = -(-SHOWN // len(picture))
        picture = np.repeat(np.repeat(picture, finer, axis=0), finer, axis=1)
        if estimate is None:
            return picture
        stage = self.stage
        poses = stage.poses[only, stage.time[only] - 1]
        joints = self.estimates.points(estimate[None], poses, stage.offsets[only])
        return draw_pose(picture, joints[0], enlarged(stage.camera(slot), finer), width=len(picture) / 100)

    def close(self) -> None:
        self.stage.close()
        self.estimates.close()


@dataclass(frozen=True, kw_only=True)
class PictureArguments(SimulatedArguments):
    """Arguments of the environments that show images.

    Attributes:
        source: kind of source of the motion.
        scored: scored pose entries and joints, arguments of `Estimates`.
    """

    motion: str
    motion_seed: int | None = None
    split: str = "train"
    size: int = 64
    observation: str | Sequence[str] = "rgb"
    camera: str | float = "side"
    background: str = "plain"
    distractors: int = 0
    alone: float = 0.0
    occluders: int = 0
    noise: float = 0.0
    brightness: float = 0.0
    gaps: float = 0.0
    gap_seconds: float = 0.3
    fps: float = 30.0
    horizon: int = 90
    speed: tuple[float, float] | None = None
    height: tuple[float, float] | None = None
    person: str = "adult"
    clothes: bool = True
    estimate: str = "pose"
    n_belief: int = 64
    actions: str = "normalised"
    file_fps: float | None = None
    unit: str | None = None
    threads: int | None = 1
    source: ClassVar[type[Source]] = Source
    scored: ClassVar[dict[str, Any]] = {}

    def __str__(self) -> str:
        return f"observation={self.observation!r}, {self.size}x{self.size}"

    @abstractmethod
    def view(self, source: Source) -> View:
        """The cameras in front of a `source`."""

    def world(self, n: int) -> PictureWorld:
        sense = PictureSettings(self.observation, self.size)
        things = self.distractors, self.occluders
        scenery = Augmentation(self.background, *things, self.noise, self.brightness, alone=self.alone)
        frames = episode_frames(self.horizon)
        reading = (self.file_fps, self.unit, self.motion_seed, self.person)
        source = self.source(self.motion, self.split, frames, self.fps, self.speed, self.height, *reading)
        view = self.view(source)
        scoring = {"threads": self.threads, "actions": self.actions, "reach": view.reach, **self.scored}
        estimates = Estimates(self.estimate, self.n_belief, **scoring)
        stage = Stage(
            n, source, view, size=sense.size, scenery=scenery, clothes=self.clothes, threads=self.threads,
            gaps=self.gaps, gap_seconds=self.gap_seconds,
        )  # fmt: skip
        return PictureWorld(stage, sense, estimates)
