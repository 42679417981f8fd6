"""Walkers off the treadmill: their way adds up, their feet stand, and their body follows the markers."""

import numpy as np
import pytest

from motionenv.body.kinematics import FOOT_BALL, forward, markers
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES, SEGMENTS
from motionenv.errors import GapError
from motionenv.models.eigenwalkers.fourier_series import positions_at
from motionenv.models.eigenwalkers.locomotion import gait
from tests.models.eigenwalkers.walks import hide, made_markers

ANKLES = [NODES.index("left_ankle"), NODES.index("right_ankle")]


FEET = [SEGMENTS.index("left_foot"), SEGMENTS.index("right_foot")]


@pytest.mark.parametrize("seed", range(6))
def test_standing_feet_stay_where_they_are(model, seed):
    motion = model.synthesize(4.0, 120.0, seed=seed)
    nodes, rotations = forward(motion.poses, motion.skeleton)
    ball = (nodes[:, ANKLES] + rotations[:, FEET] @ (FOOT_BALL * motion.skeleton.height))[..., :2]
    standing = np.gradient(ball[..., 0], axis=0).argmin(1)
    steps = np.split(np.arange(len(ball)), np.flatnonzero(np.diff(standing)) + 1)[1:-1]
    assert len(steps) > 4
    drift = [np.linalg.norm(np.ptp(ball[s, standing[s[0]]], axis=0)) for s in steps]
    assert max(drift) < 0.02


def test_the_body_follows_the_markers(model):
    made, motion = made_markers(model, 3.0, 60.0, seed=2), model.synthesize(3.0, 60.0, seed=2)
    distance = np.linalg.norm(markers(motion.poses, motion.skeleton) - made.positions, axis=-1)
    assert np.median(distance) < 0.012
    assert motion.fps == 60.0
    assert np.isfinite(motion.poses).all()


def test_the_way_is_smooth_and_adds_up(model):
    walk = gait(model.mean_)
    phase = np.linspace(0, 2 * np.pi, 2001)
    way = walk.way(phase)
    assert np.hypot(*(way[-1] - way[0])) == pytest.approx(walk.stride_length)
    np.testing.assert_allclose(walk.way(phase + 2 * np.pi) - way, np.broadcast_to(way[-1], way.shape), atol=1e-12)
    jumps = np.diff(way, n=3, axis=0) / (phase[1] ** 3)
    assert np.abs(jumps).max() < 100


def test_the_way_goes_along_x_and_the_treadmill_stays(model):
    walk = gait(model.mean_)
    phase = np.linspace(1.0, 1.0 + 2 * np.pi, 121)
    over, place = walk.positions(phase), walk.positions(phase, overground=False)
    np.testing.assert_array_equal(place, positions_at(walk.coefficients, phase))
    np.testing.assert_allclose(over[-1] - over[0], np.broadcast_to([walk.stride_length, 0, 0], (15, 3)), atol=1e-9)
    np.testing.assert_allclose(over[0], place[0] @ walk.turn.T, atol=1e-12)
    between = lambda p: np.linalg.norm(p[:, :, None] - p[:, None], axis=-1)
    np.testing.assert_allclose(between(over), between(place), atol=1e-9)


def test_the_lowest_foot_of_the_body_touches_the_ground(model):
    walk = gait(model.mean_)
    motion = walk.motion(np.linspace(0, 4 * np.pi, 200), 60.0, overground=False)
    lowest = forward(motion.poses, motion.skeleton)[0][:, ANKLES, 2].min()
    assert abs(walk.lift) > 2e-4
    assert lowest == pytest.approx(ANKLE_HEIGHT * motion.skeleton.height, abs=1e-4)
    assert walk.excess == 0.0


def test_a_walker_that_lacks_a_marker_has_no_gait_and_it_is_named(walkers):
    with pytest.raises(GapError, match="left_knee"):
        gait(hide(walkers[0], [11]).coefficients)
