"""What the writers share: axes of y-up files, rotations between segments, and what no file can hold."""

import numpy as np
import pytest

from motionenv.body import forward, from_height
from motionenv.body.skeleton import SEGMENT_PARENT
from motionenv.errors import GapError, MotionError
from motionenv.mocap.units_axes import upright
from motionenv.mocap.writers.common import check_sequence, local_rotations, y_up, y_up_turns
from motionenv.types import Motion, Skeleton


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
    body = from_height()
    other = Skeleton(body.offsets, body.radii[:4], body.height)
    with pytest.raises(MotionError, match="radii for 17 limbs, got 4"):
        check_sequence(Motion(np.zeros((2, 25)), other, 30), "XYZ", gaps=gaps)
