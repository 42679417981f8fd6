"""What the writers share: axes of y-up files, rotations between segments, and what no file can hold."""

import numpy as np
import pytest

from motionenv.body import SEGMENTS, forward
from motionenv.body.skeleton import SEGMENT_PARENT
from motionenv.errors import GapError, MotionError
from motionenv.mocap.units_axes import upright
from motionenv.mocap.writers.common import (
    check_sequence,
    checked_angles,
    facing_x,
    local_rotations,
    opensim_axes,
    shown_segments,
    without_missing,
    y_up,
    y_up_turns,
)
from motionenv.types import Motion


def test_points_written_y_up_are_those_that_reading_puts_upright_again():
    points = np.random.default_rng(0).standard_normal((4, 5, 3))
    np.testing.assert_array_equal(upright(y_up(points), "y"), points)
    np.testing.assert_array_equal(y_up([0.0, 0.0, 1.0]), [0, 1, 0])


def test_rotations_turn_with_the_axes(any_motion):
    motion = any_motion(3)
    turns, points = forward(motion.poses, motion.skeleton)[1][:, :4], np.random.default_rng(1).standard_normal(3)
    turned = y_up_turns(turns)
    np.testing.assert_allclose(turned @ y_up(points), y_up(turns @ points), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turned), 1)


def test_local_rotations_multiply_to_those_of_the_world(any_motion):
    motion = any_motion(4)
    local, world = local_rotations(motion), forward(motion.poses, motion.skeleton)[1]
    for segment in range(12):
        chained, ancestor = local[:, segment], SEGMENT_PARENT[segment]
        while ancestor >= 0:
            chained, ancestor = local[:, ancestor] @ chained, SEGMENT_PARENT[ancestor]
        np.testing.assert_allclose(chained, world[:, segment], atol=1e-12)


def changed(motion, frame, entry, value):
    poses = motion.poses.copy()
    poses[frame, entry] = value
    return Motion(poses, motion.skeleton, motion.fps)


def test_gaps_are_for_formats_that_have_them(any_motion):
    motion = any_motion(1)
    check_sequence(motion, "XYZ", gaps=False)
    gappy = changed(motion, slice(1, 3), 20, np.nan)
    check_sequence(gappy, "XYZ", gaps=True)
    says = r"left_knee_flexion of frame 1 is nan, and so are values of 2 frames: XYZ can't represent gaps"
    with pytest.raises(GapError, match=says):
        check_sequence(gappy, "XYZ", gaps=False)


@pytest.mark.parametrize("gaps", [True, False])
def test_what_no_file_can_hold_is_named(any_motion, gaps):
    motion = any_motion(1)
    with pytest.raises(MotionError, match="neck_bend of frame 2 is -inf; poses must be finite, or NaN where unknown"):
        check_sequence(changed(motion, 2, 7, -np.inf), "XYZ", gaps=gaps)
    for shape in ((0, 25), (2, 5, 25)):
        with pytest.raises(MotionError, match=rf"a XYZ file holds one sequence .*, got \({shape[0]}, "):
            check_sequence(Motion(np.zeros(shape), motion.skeleton, 30), "XYZ", gaps=gaps)


PARTS = {
    "whole": ([], set()),
    "lower body": ([slice(6, 17)], {"head", "left_upper_arm", "left_forearm", "right_upper_arm", "right_forearm"}),
    "no right leg": ([slice(21, 25)], {"right_thigh", "right_shin", "right_foot"}),
    "no left elbow": ([slice(12, 13)], {"left_forearm"}),
    "no rotation of the left hip": ([slice(19, 20)], {"left_thigh", "left_shin", "left_foot"}),
}


@pytest.mark.parametrize(("entries", "missing"), PARTS.values(), ids=PARTS)
def test_limbs_that_are_missing_in_every_frame_are_no_gaps(entries, missing, any_motion, without):
    motion = any_motion(1)
    partial = without(motion, *entries)
    known = shown_segments(partial.poses)
    assert {name for name, shown in zip(SEGMENTS, known, strict=True) if not shown} == missing
    check_sequence(partial, "XYZ", gaps=False)
    turns = local_rotations(without_missing(partial))
    np.testing.assert_array_equal(turns[:, known], local_rotations(motion)[:, known])
    with pytest.raises(GapError, match="root_x of frame 0 is nan"):
        check_sequence(without(partial, slice(0, 1)), "XYZ", gaps=False)
    with pytest.raises(GapError, match=r"root_tilt of frame 2 is nan, and so are values of 1 frames.*fill"):
        check_sequence(changed(partial, 2, 3, np.nan), "XYZ", gaps=False)


def test_angles_have_a_row_per_frame_and_a_column_per_name():
    class Angles:
        names = ("a", "b")
        values = np.array([[1, 2], [3, 4], [5, 6]])

    assert {name: column.tolist() for name, column in checked_angles(Angles(), 3).items()} == {
        "a": [1, 3, 5],
        "b": [2, 4, 6],
    }
    with pytest.raises(MotionError, match=r"must have shape \(4, 2\), .* got \(3, 2\)"):
        checked_angles(Angles(), 4)


def test_opensims_axes_are_forward_up_and_right():
    np.testing.assert_array_equal(opensim_axes(np.eye(3)), [[1, 0, 0], [0, 0, -1], [0, 1, 0]])


@pytest.mark.parametrize("quarters", range(-5, 6))
def test_quarter_turns_bring_a_walk_to_face_x(quarters, any_motion):
    motion, turn = any_motion(2, frames=50), quarters * np.pi / 2
    poses = motion.poses.copy()
    poses[:, 5] = 0.3 * np.sin(poses[:, 5])
    x, y = poses[:, 0], poses[:, 1]
    turned = poses.copy()
    turned[:, 5] += turn
    turned[:, 0], turned[:, 1] = np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y
    found = facing_x(Motion(turned, motion.skeleton, 100.0))
    expected = forward(poses, motion.skeleton)
    for made, true in zip(forward(found.poses, motion.skeleton), expected, strict=True):
        np.testing.assert_allclose(made, true, atol=1e-12)
    plain = Motion(poses, motion.skeleton, 100.0)
    assert facing_x(plain) is plain
