"""Convert estimates to an environment's action space."""

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv

from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.envs.base import Observation
from motionenv.envs.simulation.marker_world import MarkerWorld
from motionenv.errors import MotionError
from motionenv.types import MARKERS

_ARM_JOINTS = [MARKERS.index("right_elbow"), MARKERS.index("right_wrist")]


class Actions:
    """Reads an environment's spaces and converts estimates to actions.

    Attributes:
        n: number of environments; 1 for a single one.
        form, samples: "pose", "joints" or "belief", and the number of poses in an estimate.
        names: of the observations: "rgb", "mask", "depth", "points" and "seen", or "joints", which is the truth.
        arm, points: whether only the right arm is estimated, and whether it is a world of markers instead of images.
        far: depth [m] of the background in depth images.

    Raises:
        MotionError: ActiveTracking, in which several people are tracked.
    """

    def __init__(self, env: Any) -> None:
        self.env = env.unwrapped
        self.vector = isinstance(env, VectorEnv)
        self.n = env.num_envs if self.vector else 1
        space = env.single_action_space if self.vector else env.action_space
        observed = env.single_observation_space if self.vector else env.observation_space
        if isinstance(observed, spaces.Dict):
            named: dict[str, Any] = observed.spaces
        else:
            kinds = {("f", 3): "joints", ("f", 1): "depth", ("u", 1): "mask", ("u", 3): "rgb"}
            named = {kinds[observed.dtype.kind, observed.shape[-1]]: observed}
        if "roster" in named:
            raise MotionError(
                "this agent estimates one body, not where several people are: for ActiveTracking use still, sweep, "
                "greedy, planner or oracle, which are in motionenv.envs.active"
            )
        self.names = list(named)
        self.points = isinstance(self.env.world, MarkerWorld)
        self.far = float(np.max(named["depth"].high)) if "depth" in named else np.inf
        shape = space.shape
        self.form = "pose" if len(shape) == 1 else "joints" if shape[-1] == 3 else "belief"
        self.arm = shape in {(len(RIGHT_ARM),), (len(_ARM_JOINTS), 3)} or shape[-1] == len(RIGHT_ARM) + 1
        self.samples = shape[0] if self.form == "belief" else 1
        self._shape = shape

    def batched(self, observation: Observation) -> dict[str, np.ndarray]:
        """An observation by name, with a leading batch axis."""
        named = observation if isinstance(observation, dict) else {self.names[0]: observation}
        return {name: np.asarray(v) if self.vector else np.asarray(v)[None] for name, v in named.items()}

    def of(self, poses: np.ndarray | None, joints: np.ndarray) -> np.ndarray:
        """The action that says poses (n or 1, samples, 25), or joints (n or 1, samples, 15, 3)."""
        if self.arm:
            poses, joints = None if poses is None else poses[..., RIGHT_ARM], joints[..., _ARM_JOINTS, :]
        if self.form == "joints" or poses is None:
            said = joints[:, 0]
        elif self.form == "belief":
            said = np.concatenate([poses, np.zeros((*poses.shape[:2], 1))], axis=-1)
        else:
            said = poses[:, 0]
        said = self.env.action(np.broadcast_to(said, (self.n, *self._shape)))
        return said if self.vector else said[0]
