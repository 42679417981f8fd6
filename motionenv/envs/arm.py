"""motionenv/ArmTracking-v1: the right arm in images (paper C, section 6)."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from motionenv.body import from_height, markers
from motionenv.body.arm_reaching import RIGHT_ARM, reach
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.envs.base import SimulatedTracking, taking
from motionenv.envs.simulation.motion_sources import SPLITS, WALKERS, Recordings, Source
from motionenv.envs.simulation.picture_world import PictureArguments
from motionenv.envs.simulation.views import ArmView
from motionenv.envs.vector import SimulatedTrackingVector, VectorArguments
from motionenv.errors import MotionError
from motionenv.models.people import draw_person
from motionenv.types import MARKERS, POSE, Skeleton

_SCORED = tuple(MARKERS.index(name) for name in ("right_elbow", "right_wrist"))
_ANKLES = [MARKERS.index("left_ankle"), MARKERS.index("right_ankle")]
_SPARE = 3.0  # [s] length of a reaching recording beyond that of an episode


class ArmSource(Source):
    """Motion of the right arm alone; "reach" is synthesised here."""

    def open(self) -> Recordings:
        return _Reaching(self) if self.motion == "reach" else _Swinging(super().open())


@dataclass(frozen=True, kw_only=True)
class ArmArguments(PictureArguments):
    """Arguments of `ArmTracking`."""

    motion: str = "reach"
    source: ClassVar[type[Source]] = ArmSource
    scored: ClassVar[dict[str, Any]] = {"entries": RIGHT_ARM, "joints": _SCORED}

    def view(self, source: Source) -> ArmView:
        return ArmView(self.camera)


@dataclass(frozen=True, kw_only=True)
class ArmVectorArguments(ArmArguments, VectorArguments):
    """Arguments of `ArmTrackingVector`."""

    threads: int | None = None


class ArmTracking(SimulatedTracking):
    """Tracking an arm in images.

    ## Description
    The setting of Sidenbladh, Black & Sigal (2002, section 6): a person stands still and moves the right arm, which has
    four degrees of freedom. Images are stabilised: the shoulder is always in the centre. Each step shows the next
    image, and the agent estimates the joint angles, or the positions of elbow and wrist.

    Positions are in metres. The person stands at the origin and looks along x; y points to the left, z up, and the
    ground is at z = 0. The camera is 2.4 m from the shoulder, level with it.

    Actions don't change what is seen. This is an estimation problem, for which a discount of γ = 0 is right.

    ## Action Space
    An estimate for the last observed frame, in the form given by `estimate`:

    - "pose": `Box(-1, 1, (4,), float32)`, flexion, abduction and rotation of the right shoulder and flexion of the
      elbow, applied to the true body.
    - "joints": `Box(-1, 1, (2, 3), float32)`, positions of elbow and wrist.
    - "belief": `Box(-1, 1, (n_belief, 5), float32)`, weighted poses: four angles, then a log weight.

    Entries are scaled as in `WalkerTracking`, with a reach of 2 m.

    ## Observation Space
    As in `WalkerTracking`: "rgb", "mask", "depth", "joints", or a `Dict` of several.

    ## Rewards
    Minus the mean distance [m] between the estimated and true positions of elbow and wrist. For a belief, minus its
    energy score over both, divided by √2. `info["error"]` is the mean distance; for a belief, that of its mean.

    ## Starting State
    Person, arm motion, colours, view and scenery are random.

    ## Episode End
    Truncated after `horizon` estimates; never terminated.

    ## Arguments
    - `motion="reach"`: minimum-jerk movements between random postures; or a motion of `WalkerTracking`, of which only
      the right arm is used.
    - `camera="side"`: "side" (from the right), "front", a view angle in degrees, or "random".
    - `horizon=90` and all other arguments are as in `WalkerTracking`, except that there is neither `start` nor `path`.

    `truth()` returns "pose" (25,), "joints" (15, 3), "camera" and "skeleton"; `observation_model` is that of
    `WalkerTracking`, for whole poses.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/ArmTracking-v1", num_envs=64)` renders all images of a step in one batch. It also
    accepts `autoreset_mode` ("NextStep", "SameStep", "Disabled") and `threads`, None for one per core.

    ## Version History
    - v1: actions are normalised, and losing the track doesn't end the episode.
    - v0: initial version.
    """

    @taking(ArmArguments)
    def __init__(self, arguments: ArmArguments) -> None:
        super().__init__(arguments)


class ArmTrackingVector(SimulatedTrackingVector):
    """`num_envs` copies of `ArmTracking` in an `autoreset_mode`, rendered in batches by `threads` threads."""

    @taking(ArmVectorArguments)
    def __init__(self, arguments: ArmVectorArguments) -> None:
        super().__init__(arguments)


@lru_cache(maxsize=8)  # equal sources share their recordings
class _Reaching:
    """Synthetic reaching: `WALKERS` recordings per split, each made when first needed."""

    def __init__(self, source: Source):
        if source.seed is not None:
            raise MotionError("motion_seed needs a model as motion: omit it for motion 'reach'")
        if source.speed is not None:
            raise MotionError("speed needs a walking motion: omit it for motion 'reach'")
        self._source = source
        self._made: dict[int, tuple[np.ndarray, Skeleton]] = {}

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        number = int(rng.integers(WALKERS))
        if number not in self._made:
            self._made[number] = self._make(number)
        poses, body = self._made[number]
        start = int(rng.integers(len(poses) - self._source.frames + 1))
        return poses[start : start + self._source.frames], body

    def _make(self, number: int) -> tuple[np.ndarray, Skeleton]:
        source = self._source
        rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(SPLITS.index(source.split), number)))
        height = None if source.height is None else float(rng.uniform(*source.height))
        body = draw_person(rng, person=source.person, height=height).body(from_height(1.0).offsets)
        frames = source.frames + round(_SPARE * source.fps)
        return _standing(reach(frames, source.fps, rng), body), body


class _Swinging:
    """The right arm of recordings of other motion."""

    def __init__(self, recordings: Recordings):
        self._recordings = recordings

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        poses, body = self._recordings.draw(rng)
        return _standing(poses[:, RIGHT_ARM], body), body


def _standing(arm: np.ndarray, body: Skeleton) -> np.ndarray:
    """Poses (frames, 25) of a body that stands still except for its right arm's angles (frames, 4) [rad]."""
    poses = np.zeros((len(arm), len(POSE)))
    poses[:, POSE.index("left_shoulder_abduction")] = 0.1
    poses[:, POSE.index("left_elbow_flexion")] = 0.15
    poses[:, 2] = ANKLE_HEIGHT * body.height - markers(poses[0], body)[_ANKLES, 2].min()
    poses[:, RIGHT_ARM] = arm
    return poses
