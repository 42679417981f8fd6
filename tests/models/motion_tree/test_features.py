from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

import motionenv
from motionenv.errors import MotionError
from motionenv.models.motion_tree import features as frames
from motionenv.models.transforms import resample
from motionenv.types import Motion


@pytest.fixture(scope="module")
def walk():
    return motionenv.load("walk/fpca").synthesize(seconds=3, fps=30, seed=5)


def literal(poses):
    """Parameters frame by frame, as the module's docstring tells them."""
    steps = [None] + [
        np.concatenate([np.linalg.solve(turn(a[5]), b[:2] - a[:2]), b[2:5], [b[5] - a[5]], b[6:]])
        for a, b in pairwise(poses)
    ]
    return np.array([[*b, *(b - a) * 30.0] for a, b in pairwise(steps[1:])])


def turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def test_parameters_are_increments_angles_and_their_velocities(walk):
    np.testing.assert_allclose(frames.parameters(walk.poses)[2:], literal(walk.poses), atol=1e-9)


def test_the_first_frame_moves_as_the_second(walk):
    first, second = frames.parameters(walk.poses)[:2]
    still = [0, 1, 5]  # increments, and what changes them: nothing
    np.testing.assert_array_equal(first[still], second[still])
    np.testing.assert_array_equal(first[25:], second[25:])
    np.testing.assert_array_equal(np.array([first, second])[:, 25 + np.array(still)], 0)
    np.testing.assert_array_equal(first[6:25], walk.poses[0, 6:])


def test_sequences_of_a_batch_do_not_meet(walk):
    batch = np.stack([walk.poses[:20], walk.poses[30:50]])
    np.testing.assert_array_equal(frames.parameters(batch)[1], frames.parameters(walk.poses[30:50]))


@given(st.floats(-3, 3), st.floats(-50, 50), st.floats(-50, 50))
def test_place_and_heading_do_not_matter(heading, x, y):
    walk = motionenv.load("walk/fpca").synthesize(seconds=0.5, fps=30, seed=5).poses
    moved = walk.copy()
    moved[:, :2] = walk[:, :2] @ turn(heading).T + [x, y]
    moved[:, 5] += heading
    np.testing.assert_allclose(frames.parameters(moved), frames.parameters(walk), atol=1e-9)


def test_placed_undoes_local(walk):
    step = frames.local(walk.poses[:-1], walk.poses[1:])
    np.testing.assert_allclose(frames.placed(walk.poses[:-1], step[:, None])[:, 0], walk.poses[1:], atol=1e-12)
    np.testing.assert_allclose(frames.parameters(walk.poses)[1:, :25], step, atol=1e-12)


@pytest.mark.parametrize("fps", [24.0, 60.0, 100.0, 120.0])
def test_resampling_follows_a_smooth_motion(walk, fps):
    at = CubicSpline(np.arange(len(walk.poses)) / 30, walk.poses)
    seconds = np.arange(int(2.9 * fps)) / fps
    (again,) = resample(Motion(at(seconds), walk.skeleton, fps))
    assert abs(len(again) - 2.9 * 30) <= 2
    assert np.abs(again - at(np.arange(len(again)) / 30)).max() < 0.012


def test_resampling_to_the_same_rate_changes_nothing_but_whole_turns(walk):
    turned = walk.poses.copy()
    turned[:, 12] += 4 * np.pi
    (again,) = resample(Motion(turned, walk.skeleton, 30.0))
    np.testing.assert_allclose(again, walk.poses, atol=1e-12)


def test_a_gap_ends_a_stretch(walk):
    poses = walk.poses.copy()
    poses[40, 7] = np.nan
    poses[60:62] = np.nan
    assert [len(s) for s in resample(Motion(poses, walk.skeleton, 30.0))] == [40, 19, 28]


def test_bad_shapes_are_named():
    with pytest.raises(MotionError, match=r"2 or more frames, 25\), got \(1, 25\)"):
        frames.parameters(np.zeros((1, 25)))
    batch = motionenv.load("walk/fpca").walks(seconds=1, fps=30, seed=1, n=2)
    with pytest.raises(MotionError, match="one sequence at a time"):
        resample(batch)


@given(st.integers(-3, 3), st.sampled_from([3, 6, 9, 12, 20]))
def test_whole_turns_do_not_matter(turns, angle):
    walk = motionenv.load("walk/fpca").synthesize(seconds=0.5, fps=30, seed=5).poses
    turned = walk.copy()
    turned[7:, angle] += 2 * np.pi * turns
    np.testing.assert_allclose(frames.parameters(turned), frames.parameters(walk), atol=1e-8)


@pytest.mark.parametrize("joint", ["neck", "left_shoulder", "right_hip"])
def test_the_other_way_to_tell_a_rotation_is_undone(walk, joint):
    """(f, a, r) and (f + π, π - a, r + π) put the body in the same place; a clip is told the plain way."""
    at = motionenv.types.POSE.index(f"{joint}_flexion")
    other = walk.poses.copy()
    other[:, at : at + 3] = other[:, at : at + 3] * [1, -1, 1] + np.pi
    np.testing.assert_allclose(
        motionenv.markers(other, walk.skeleton), motionenv.markers(walk.poses, walk.skeleton), atol=1e-12
    )
    (told,) = resample(Motion(other, walk.skeleton, 30.0))
    np.testing.assert_allclose(told, walk.poses, atol=1e-12)


def test_turned_towards_is_within_half_a_turn(walk):
    turned = frames.turned_towards(walk.poses + 11.0, walk.poses[0])
    assert np.abs(turned - walk.poses[0])[:, 3:].max() <= np.pi + 1e-9
    np.testing.assert_allclose(np.cos(turned[:, 3:]), np.cos(walk.poses[:, 3:] + 11.0), atol=1e-9)
    np.testing.assert_array_equal(turned[:, :3], walk.poses[:, :3] + 11.0)
