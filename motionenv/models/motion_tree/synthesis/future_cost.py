"""Costs of the windows' futures, and the feet that stand: criteria of synthesis beyond nearness.

The future cost of a window, after the video textures of Schödl et al. (2000, section 3.1): going on costs nothing, a
jump the squared distance to the window jumped to, and what lies ahead counts less the further away it is,

    V(i) = a(i) + min(γ V(i + 1), min over j elsewhere of |z_i - z_j|² + γ V(j))

so that a window near the end of its sequence is good only when there is a near way out that itself leads on. Each
window of another activity than the wanted one costs a(i) = 0.1, and so does each that doesn't turn to the wanted side.
As p(i | t) is a kernel of squared distances too, exp(-V / 2β) is the weight that the future gives a window.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionenv._core.threads import in_chunks
from motionenv.body.kinematics import FOOT_BALL, feet
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.models.motion_tree.database import Database
from motionenv.models.motion_tree.features import FPS, WINDOW
from motionenv.models.motion_tree.synthesis._future_cost_kernels import future_cost, nearest_elsewhere
from motionenv.models.motion_tree.synthesis._generator_kernels import HERE

#: Height of the ball's centre on the ground [shares of the body's height].
BALL_HEIGHT = ANKLE_HEIGHT + FOOT_BALL[2]

_TAIL = 30  # frames before the end of a sequence from which it may be left
_EXITS = 32  # nearest windows elsewhere that are looked at
_TOLL = 0.1  # a(i), squared distance per frame
_DISCOUNT, _FARSIGHTED = 0.97, 0.99  # γ, per frame, and where an activity or a turn is wanted
_TURNS = 0.2  # [rad] least change of heading in the next second of a window that turns
_SWEEPS = 50
_HORIZON = 30  # frames over which turns and speeds are looked ahead
_STANDING_SPEED = 0.5  # [m/s] of the ball of a foot, below which it may stand
_LOWEST, _FLAT = 5, 10  # percentiles of height that stand for the balls of feet, and the ankles, on the ground
_STANDING_HEIGHT = 0.03  # [shares of the body's height] above the lowest of the sequence


@dataclass(frozen=True, eq=False)
class FutureCost:
    """Future of each window, by position in the tree."""

    starts: np.ndarray  # of the sequences
    frames: np.ndarray  # last frames of the windows by position
    place: np.ndarray  # (frames,) position of the window that ends at each frame of the database, or -1
    #: Positions of windows near the ends of sequences (m,), the nearest windows elsewhere (m, k), and squared distances
    #: to them (m, k).
    exits: tuple[np.ndarray, np.ndarray, np.ndarray]
    turn: np.ndarray  # (n,) [rad] by which the heading changes in the next second
    speed: np.ndarray  # (n,) [m/s] mean over the next second
    activity: np.ndarray  # (n,) index of the activity in `activities`
    activities: tuple[str, ...]
    stands: np.ndarray  # (frames, 2) whether the left and the right foot stand
    #: (n, 3) [m] of the window's sequence: by how much to move the root so that the soles of feet that stand are on the
    #: ground z = 0; how high such ankles are in the sequence; and how much less the root would have to be moved for the
    #: balls of feet whose heel has risen.
    ground: np.ndarray

    @cached_property
    def _known(self) -> dict[tuple[int, int], tuple[np.ndarray, np.ndarray]]:
        return {}

    def towards(self, activity: int = -1, side: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Future cost V (n,) of each window, and the best window to jump to (n,) where its sequence ends, else -1.

        For an activity by index, or any (-1), and turns to the left (`side` 1), to the right (-1), or any (0); each is
        worked out once.
        """
        wanted = activity, side
        if wanted not in self._known:
            n = len(self.frames)
            toll = np.zeros(n, dtype=np.float32)
            if activity >= 0:
                toll += _TOLL * (self.activity != activity)
            if side:
                toll += _TOLL * (side * self.turn < _TURNS)
            cost, way_out = np.zeros(n, dtype=np.float32), np.full(n, -1, dtype=np.int32)
            discount = _DISCOUNT if wanted == (-1, 0) else _FARSIGHTED
            future_cost(self.starts, self.frames, self.place, *self.exits, toll, discount, _SWEEPS, cost, way_out)
            self._known[wanted] = cost, way_out
        return self._known[wanted]

    @cached_property
    def _courses(self) -> dict[tuple[int, bool], tuple[np.ndarray, np.ndarray]]:
        return {}

    def courses(self, activity: int = -1, turns: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """The same two for several courses, (courses, n): any, and with `turns` also to the left and to the right."""
        wanted = activity, turns
        if wanted not in self._courses:
            found = [self.towards(activity, side) for side in ((0, 1, -1) if turns else (0,))]
            self._courses[wanted] = np.stack([cost for cost, _ in found]), np.stack([way_out for _, way_out in found])
        return self._courses[wanted]


def fit_future_cost(database: Database, frames: np.ndarray, blocks: np.ndarray) -> FutureCost:
    """The outlook of n windows, whose last frames are `frames` (n,), by position in `blocks`."""
    n = len(frames)
    place = np.full(len(database.poses), -1, dtype=np.int32)
    place[frames] = np.arange(n, dtype=np.int32)
    tails = place[_tails(database.starts)]
    exits = np.empty((len(tails), _EXITS), dtype=np.int32)
    distances = np.empty(exits.shape, dtype=np.float32)

    def search(start, stop):
        nearest_elsewhere(blocks, frames, tails[start:stop], HERE, exits[start:stop], distances[start:stop])

    in_chunks(search, len(tails))
    ends = np.minimum(frames + _HORIZON, database.starts[np.searchsorted(database.starts, frames, side="right")] - 1)
    place_and_heading = database.poses[:, [0, 1, 5]]
    x, y, turn = (place_and_heading[ends] - place_and_heading[frames]).T
    speed = (np.hypot(x, y) * FPS / (ends - frames)).astype(np.float32)
    sequence = database.sequence_of(frames)
    activities = tuple(sorted(set(database.activities)))
    label = np.array([activities.index(a) for a in database.activities], dtype=np.int16)
    stands, ground = _standing(database)
    near = tails, exits, distances
    labels = label[sequence]
    return FutureCost(database.starts, frames, place, near, turn, speed, labels, activities, stands, ground[sequence])


def _tails(starts: np.ndarray) -> np.ndarray:
    """Last frames of the windows near the end of each sequence, the last of each first."""
    ends = starts[1:, None] - 2 - np.arange(_TAIL)
    return ends[ends >= starts[:-1, None] + WINDOW - 1]


def _standing(database: Database) -> tuple[np.ndarray, np.ndarray]:
    """Whether each foot (frames, 2) stands, its ball slow and low; and the ground (sequences, 3) of `FutureCost`."""
    height = database.skeleton.height
    stands = np.empty((len(database.poses), 2), dtype=bool)
    ground = np.empty((len(database.clips), 3), dtype=np.float32)
    for i, (first, last) in enumerate(zip(database.starts[:-1], database.starts[1:], strict=True)):
        ankles, balls = feet(database.poses[first:last], database.skeleton)
        speed = np.linalg.norm(np.gradient(balls[..., :2], 1 / FPS, axis=0), axis=-1)
        lowest = np.percentile(balls[..., 2].min(1), _LOWEST)
        low = balls[..., 2] < lowest + _STANDING_HEIGHT * height
        here = stands[first:last] = _steady(low & (speed < _STANDING_SPEED))
        ankle = np.percentile(ankles[here, 2] if here.any() else ankles[..., 2].min(1), _FLAT)
        sole, ball = ANKLE_HEIGHT * height - ankle, BALL_HEIGHT * height - lowest
        ground[i] = sole, ankle, max(ball - sole, 0.0)
    return stands, ground


def _steady(stands: np.ndarray) -> np.ndarray:
    """`stands` (frames, 2) with single frames that differ from both neighbours set right."""
    inner = stands[:-2] & stands[2:] | stands[1:-1] & (stands[:-2] | stands[2:])
    return np.concatenate([stands[:1], inner, stands[-1:]])
