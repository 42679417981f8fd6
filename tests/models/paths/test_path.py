"""Paths, and walks bent along them."""

from dataclasses import replace

import numpy as np
import pytest

import motionenv
from motionenv.body import feet, mirror
from motionenv.errors import GapError, MotionError
from motionenv.models.paths import WalkPath, bend, random_path
from motionenv.types import Motion


@pytest.mark.parametrize("angle", [2.5, -4.0])
def test_an_arc_lies_on_its_circle(angle):
    path = WalkPath.arc(1.7, angle, heading=0.4, start=(2.0, -1.0))
    s = np.linspace(0, path.length, 777)
    centre = np.array([2.0, -1.0]) + np.sign(angle) * 1.7 * np.array([-np.sin(0.4), np.cos(0.4)])
    np.testing.assert_allclose(np.linalg.norm(path.position(s) - centre, axis=-1), 1.7, atol=1e-9)
    np.testing.assert_allclose(path.heading(s), 0.4 + s / 1.7 * np.sign(angle), atol=1e-9)
    np.testing.assert_allclose(path.curvature(s), np.sign(angle) / 1.7, rtol=1e-6)
    assert path.length == pytest.approx(1.7 * abs(angle))


def test_beyond_its_ends_a_path_goes_straight_on():
    path = WalkPath.arc(2.0, 1.0)
    tip, way = path.position(2.0), np.array([np.cos(1.0), np.sin(1.0)])
    np.testing.assert_allclose(path.position([2.5, 4.0]), tip + np.outer([0.5, 2.0], way), atol=1e-12)
    np.testing.assert_allclose(path.position(-3.0), [-3.0, 0.0])
    np.testing.assert_array_equal(path.curvature([-0.1, 2.1]), 0.0)


def test_a_path_goes_through_its_points():
    points = np.array([[0, 0], [2, 0.5], [5, -1], [8, 2], [6, 5]], dtype=float)
    path = WalkPath.through(points)
    s = np.linspace(0, path.length, 20_000)
    gaps = np.linalg.norm(path.position(s)[:, None] - points, axis=-1).min(axis=0)
    assert gaps.max() < 1e-3
    steps = np.linalg.norm(np.diff(path.position(s), axis=0), axis=-1)
    np.testing.assert_allclose(steps, s[1], rtol=1e-4)  # arc length


def test_position_and_heading_are_integrals_of_heading_and_curvature():
    path = random_path(np.random.default_rng(5), 12.0, radius=1.0, scale=1.0, heading=2.0, start=(1.0, 2.0))
    s = np.linspace(0, 12.0, 24_001)
    velocity = np.gradient(path.position(s), s, axis=0)
    np.testing.assert_allclose(velocity, np.stack([np.cos(path.heading(s)), np.sin(path.heading(s))], -1), atol=2e-3)
    middle = 0.5 * (s[1:] + s[:-1])
    np.testing.assert_allclose(np.diff(path.heading(s)) / s[1], path.curvature(middle), atol=2e-2)
    assert path.heading(0.0) == 2.0


def test_random_paths_keep_their_radius_and_wind_both_ways():
    paths = [random_path(np.random.default_rng(seed), 30.0, radius=1.5) for seed in range(10)]
    bends = np.array([path.curvature(np.linspace(0, 30, 3001)) for path in paths])
    assert np.abs(bends).max() <= 1 / 1.5
    assert (bends > 0.1).any(axis=1).all()
    assert (bends < -0.1).any(axis=1).all()
    again = random_path(np.random.default_rng(3), 30.0, radius=1.5)
    np.testing.assert_array_equal(again.headings, paths[3].headings)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: WalkPath.arc(0.3, 1.0), "radius must be"),
        (lambda: WalkPath.arc(2.0, 0.0), "angle must not be 0"),
        (lambda: WalkPath.line(-1.0), "length"),
        (lambda: WalkPath.through([(0, 0)]), "at least two"),
        (lambda: WalkPath.through([(0, 0), (0, 0)]), "no two in a row"),
        (lambda: WalkPath.through([(0, 0), (1, 0), (1, 0.2), (0, 0.2)]), "radius of .* people need 0.6 m"),
        (lambda: WalkPath([0.0, np.nan], 1.0, (0, 0)), "finite"),
        (lambda: random_path(np.random.default_rng(0), 5.0, radius=0.1), "radius must be"),
    ],
)
def test_curves_that_nobody_can_walk_are_refused(make, match):
    with pytest.raises(MotionError, match=match):
        make()


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
