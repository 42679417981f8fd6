"""Bent walks: symmetries that any right way to bend has, feet that stand, lean and steps by closed forms."""

from dataclasses import replace

import numpy as np
import pytest

import motionenv
from motionenv.body import feet, mirror
from motionenv.errors import GapError, MotionError
from motionenv.models.paths import WalkPath, bend
from motionenv.types import Motion

MODELS = ("walk/fpca", "walk/eigenwalkers")


@pytest.fixture(scope="module", params=MODELS)
def walk(request):
    return motionenv.synthesize(request.param, 6, 60, seed=3, speed=1.2, variation=0.0)


def test_straight_ahead_hardly_anything_changes(walk):
    """But for the drift to a side, and feet that slip."""
    same = bend(walk, WalkPath.line(20))
    moved = feet(same.poses, walk.skeleton)[0] - feet(walk.poses, walk.skeleton)[0]
    assert np.median(np.abs(moved), axis=(0, 1))[[0, 2]].max() < 0.01
    np.testing.assert_allclose(same.poses[:, 6:17], walk.poses[:, 6:17], atol=1e-9)
    assert np.degrees(np.abs(same.poses[:, 17:] - walk.poses[:, 17:])).mean() < 3


def test_a_turned_path_turns_the_walk(walk):
    """Bending doesn't know where x is."""
    arc = bend(walk, WalkPath.arc(3, 2))
    other = bend(walk, WalkPath.arc(3, 2, heading=1.1, start=(4, -2)))
    turn = np.array([[np.cos(1.1), np.sin(1.1)], [-np.sin(1.1), np.cos(1.1)]])
    np.testing.assert_allclose(other.poses[:, :2], arc.poses[:, :2] @ turn + [4, -2], atol=1e-9)
    np.testing.assert_allclose(other.poses[:, 5], arc.poses[:, 5] + 1.1, atol=1e-9)
    keep = [2, 3, 4, *range(6, 25)]
    np.testing.assert_allclose(other.poses[:, keep], arc.poses[:, keep], atol=1e-6)


def test_left_and_right_are_mirror_images(walk):
    # The mirror image of a person whose sides differ needs the mirrored body.
    offsets = 0.5 * (walk.skeleton.offsets + _exchanged(walk.skeleton.offsets))
    walk = replace(walk, skeleton=replace(walk.skeleton, offsets=offsets))
    left = bend(walk, WalkPath.arc(2.5, 2))
    right = bend(replace(walk, poses=mirror(walk.poses)), WalkPath.arc(2.5, -2))
    np.testing.assert_allclose(mirror(right.poses), left.poses, atol=1e-6)


def _exchanged(offsets):
    sides = [0, 1, 2, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 15]
    return offsets[sides] * [1.0, -1.0, 1.0]


def test_feet_that_stand_stay(walk):
    motion = bend(walk, WalkPath.arc(2, 4))
    balls = feet(motion.poses, motion.skeleton)[1][..., :2]
    pace = np.linalg.norm(np.gradient(balls, axis=0), axis=-1) * 60
    assert 0.35 < (pace < 0.02).mean() < 0.75  # each foot stands more than half the time
    assert np.abs(np.diff(motion.poses[:, 17:], axis=0)).max() < 0.3


def test_lean_and_steps_follow_the_turn(walk):
    """Gravity and the centrifugal force at 1.2 m/s and 2 m; feet stand as far outside as the pelvis' height leans."""
    motion = bend(walk, WalkPath.arc(2, 4))
    straight = bend(walk, WalkPath.line(20))
    lean = -(motion.poses[:, 4] - straight.poses[:, 4])[120:240].mean()
    assert lean == pytest.approx(np.arctan(1.2**2 / (9.81 * 2)), rel=0.1)
    balls = feet(motion.poses, motion.skeleton)[1][..., :2]
    stands = np.linalg.norm(np.gradient(balls, axis=0), axis=-1) * 60 < 0.02
    inner, outer = (np.linalg.norm(balls[60:300, i][stands[60:300, i]] - [0, 2], axis=-1).mean() for i in (0, 1))
    assert 0.0 < outer - inner < 0.3
    assert 0.5 * (inner + outer) == pytest.approx(2 + motion.poses[:, 2].mean() * np.tan(lean), abs=0.02)
    mean = np.linalg.norm(np.diff(motion.poses[60:300, :2], axis=0), axis=-1).sum()
    assert mean == pytest.approx(1.2 * 239 / 60, rel=0.06)
    distance = np.linalg.norm(motion.poses[:, :2] - [0, 2], axis=-1)
    assert np.abs(distance - 2).max() < 0.08


def test_unknown_arms_stay_unknown_and_unknown_legs_are_refused(walk):
    poses = walk.poses.copy()
    poses[:, 9:17] = np.nan
    bent = bend(replace(walk, poses=poses), WalkPath.arc(3, 1))
    np.testing.assert_array_equal(np.isnan(bent.poses), np.isnan(poses))
    poses[5, 20] = np.nan
    with pytest.raises(GapError, match="legs"):
        bend(replace(walk, poses=poses), WalkPath.arc(3, 1))
    with pytest.raises(MotionError, match="two frames"):
        bend(Motion(walk.poses[:1], walk.skeleton, 60), WalkPath.line(1))


def test_nobody_walks_round_a_sharp_turn_fast():
    walk = motionenv.synthesize("walk/fpca", 4, 60, seed=3, speed=2.3)
    with pytest.raises(MotionError, match="too fast for a turn with a radius of 1.00 m"):
        bend(walk, WalkPath.arc(1, 3))
