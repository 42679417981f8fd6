"""The world of the image environments."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from motionenv.envs.simulation.estimates import Estimates
from motionenv.envs.simulation.stage import PictureSettings, Stage
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.render.draw2d.overlay import draw_pose
from motionenv.render.request import enlarged

#: Least side of an image of `render` [pixels].
SHOWN = 256


class PictureWorld:
    """A `motionenv.envs.World` of people on a `stage` in front of cameras; `sense` is what images are observed.

    The `stage` holds the episodes, `sense` says which images are observed, `estimates` has action space and scoring.
    """

    def __init__(self, stage: Stage, sense: PictureSettings, estimates: Estimates) -> None:
        self.stage, self.estimates, self._sense = stage, estimates, sense
        self.n, self.horizon, self.fps = stage.n, stage.motions.frames - 1, stage.motions.fps
        self.observation_space: gymnasium.Space = sense.space
        self.scale = estimates.scale
        self.action_space: spaces.Box = self.scale.space
        self.time = stage.time
        self._models: dict[int, SilhouetteLikelihood] = {}
        self._known = np.full((self.n, 2), -1)
        self._episodes = np.zeros(self.n, dtype=np.intp)

    def begin(self, slots: np.ndarray, rngs: Sequence[np.random.Generator]) -> None:
        """As `World.begin`, for `slots` with their `rngs`."""
        self.stage.begin(slots, rngs)
        self._episodes[slots] += 1
        farthest = float(np.abs(self.stage.poses[slots, :, :2]).max())
        if farthest > self.scale.reach:
            raise MotionError(
                f"somebody goes {farthest:.1f} m from the origin, and normalised actions reach {self.scale.reach:g} m: "
                'use actions="metric", or a shorter horizon'
            )

    def observe(self, slots: np.ndarray) -> np.ndarray | dict[str, np.ndarray]:
        """As `World.observe`, of `slots`."""
        return self._sense.of(self.stage.draw(slots, rgb=self._sense.rgb))

    def judge(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `World.judge`, of `actions`."""
        return self.estimates.judge(actions, self.stage.now(), self.stage.offsets)

    def advance(self, slots: np.ndarray) -> None:
        """As `World.advance`, for `slots`."""
        self.time[slots] += 1

    def truth(self, slot: int) -> dict[str, Any]:
        """As `Stage.truth`, of `slot`."""
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
            self._models[slot].observe(**self._sense.evidence(frame))
            self._known[slot] = self._episodes[slot], self.time[slot]
        return self._models[slot]

    def render(self, slot: int, estimate: np.ndarray | None) -> np.ndarray:
        """As `World.render`, of `slot` with its `estimate`."""
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
        """As `World.close`."""
        self.stage.close()
        self.estimates.close()
