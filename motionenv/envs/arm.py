"""motionenv/ArmTracking-v0: the right arm in pictures, as in paper C, section 6."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from motionenv.body import from_height, markers
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.envs.pictures import PictureTracking, PictureTrackingVector, picture_world
from motionenv.envs.sources import HEIGHT, SPLITS, WALKERS, Recordings, Source
from motionenv.envs.views import ArmView
from motionenv.envs.world import PictureWorld
from motionenv.errors import MotionError
from motionenv.models.reaching import RIGHT_ARM, reach
from motionenv.types import MARKERS, POSE, Skeleton

_SCORED = tuple(MARKERS.index(name) for name in ("right_elbow", "right_wrist"))
_ANKLES = [MARKERS.index("left_ankle"), MARKERS.index("right_ankle")]
_SPARE = 3.0  # seconds that a recording of reaching is longer than an episode


def arm_world(n: int, *, motion: str = "reach", **arguments: Any) -> PictureWorld:
    """`n` people who stand and move an arm, each before a camera of his own.

    Args:
        n: how many.
        motion: whence the arm's motion comes.
        arguments: see `picture_world`.

    Raises:
        MotionError: an impossible argument; names it.
    """
    return picture_world(
        n,
        lambda source, camera: (ArmMotion(source), ArmView(camera)),
        motion=motion,
        scored={"entries": RIGHT_ARM, "joints": _SCORED},
        **arguments,
    )


class ArmTracking(PictureTracking):
    """Tracking an arm in pictures.

    ## Description
    The setting of Sidenbladh, Black & Sigal (2002, section 6): somebody stands still and moves the right arm, four
    degrees of freedom; pictures are stabilised, so that the shoulder is in the middle of each. Each step shows the next
    picture, and the agent says how the arm is bent, or where elbow and wrist are.

    Positions are in metres: the person stands at the origin and looks along x, y is left, z up, the ground at z = 0.
    The camera is 2.4 m from the shoulder, level with it.

    ## Action Space
    An estimate for the frame that was observed last, in the form of `estimate`:

    - "pose": `Box(-4π, 4π, (4,), float32)`, flexion, abduction and rotation of the right shoulder and flexion of the
      elbow [rad], on the true body.
    - "joints": `Box(-100, 100, (2, 3), float32)`, positions [m] of elbow and wrist.
    - "belief": `Box((n_belief, 5), float32)`, weighted poses: four angles, then a log weight within ±100.

    ## Observation Space
    As in `WalkerTracking`: "rgb", "mask", "depth", or a `Dict` of several.

    ## Rewards
    Minus the mean distance [m] between the estimated and true positions of elbow and wrist; for a belief minus its
    energy score over both, divided by √2. `info["error"]` is the mean distance; for a belief that of its mean.

    ## Starting State
    Person, what the arm does, colours, view and surroundings are drawn at random.

    ## Episode End
    Truncated after `horizon` estimates; terminated when lost, as in `WalkerTracking`.

    ## Arguments
    - `motion="reach"`: from one random posture to the next, with least jerk; or what `WalkerTracking` takes, of which
      only the right arm is kept, as it swings in walking.
    - `camera="side"`: "side" (the right one), "front", a view angle in degrees, or "random".
    - `horizon=90`, and all else as in `WalkerTracking`.

    `truth()` gives "pose" (25,), "joints" (15, 3), "camera" and "skeleton"; `observation_model` is that of
    `WalkerTracking`, for whole poses.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/ArmTracking-v0", num_envs=64)` draws all pictures of a step together; it takes
    `autoreset_mode` and `threads` too.

    ## Version History
    - v0: initial version.

    Args:
        render_mode: None, "rgb_array" or "human".
        lost_after: error [m] beyond which the track counts as lost; None for never.
        arguments: see Arguments.
    """

    make_world = staticmethod(arm_world)


class ArmTrackingVector(PictureTrackingVector):
    """`num_envs` times `ArmTracking`, drawn together: see `PictureTrackingVector`."""

    make_world = staticmethod(arm_world)


@dataclass(frozen=True)
class ArmMotion:
    """Motion of the right arm alone.

    Attributes:
        source: of which the arm is taken; its motion "reach" is made here.
    """

    source: Source

    @property
    def frames(self) -> int:
        """Of an episode."""
        return self.source.frames

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.source.fps

    def open(self) -> Recordings:
        """The recordings, shared with every equal motion of this process."""
        return _opened(self)


@lru_cache(maxsize=8)
def _opened(motion: ArmMotion) -> Recordings:
    source = motion.source
    if source.motion == "reach" and source.seed is not None:
        raise MotionError("motion_seed is for models, which synthesise: leave it out for motion 'reach'")
    return _Reaching(source) if source.motion == "reach" else _Swinging(source.open())


class _Reaching:
    """As many recordings per split as a model has walkers, each made when first needed."""

    def __init__(self, source: Source):
        if source.speed is not None:
            raise MotionError("speed is that of walking: leave it out for motion 'reach'")
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
        body = from_height(float(rng.uniform(*(source.height or HEIGHT))))
        frames = source.frames + round(_SPARE * source.fps)
        return _standing(reach(frames, source.fps, rng), body), body


class _Swinging:
    """The right arm of recordings of something else."""

    def __init__(self, recordings: Recordings):
        self._recordings = recordings

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        poses, body = self._recordings.draw(rng)
        return _standing(poses[:, RIGHT_ARM], body), body


def _standing(arm: np.ndarray, body: Skeleton) -> np.ndarray:
    """Poses (frames, 25) of a body that stands still but for its right arm's angles (frames, 4) [rad]."""
    poses = np.zeros((len(arm), len(POSE)))
    poses[:, POSE.index("left_shoulder_abduction")] = 0.1
    poses[:, POSE.index("left_elbow_flexion")] = 0.15
    poses[:, 2] = ANKLE_HEIGHT * body.height - markers(poses[0], body)[_ANKLES, 2].min()
    poses[:, RIGHT_ARM] = arm
    return poses
