"""What flows between the stages: checked at the door, read-only inside, whole after pickling."""

import pickle

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import FormatError, MotionError
from motionenv.types import ANGLES, MARKERS, POSE, Camera, Cycles, Markers, Motion, Points

K = np.array([[100.0, 0, 31.5], [0, 100, 23.5], [0, 0, 1]])


def motion(**changes):
    return Motion(**{"poses": np.zeros((3, 25)), "skeleton": from_height(), "fps": 30} | changes)


def test_orders_have_the_papers_lengths():
    assert (len(MARKERS), len(POSE), len(ANGLES)) == (15, 25, 19)
    assert len(set(POSE)) == 25


@pytest.mark.parametrize("fps", [0, -30, float("nan"), float("inf"), "30", True, None])
def test_impossible_frame_rates_are_named(fps):
    with pytest.raises(MotionError, match="fps must be a number of frames per second above 0"):
        motion(fps=fps)


def test_shapes_are_named():
    with pytest.raises(MotionError, match=r"Motion.poses must have shape \(\.\.\., n, 25\), got \(3, 24\)"):
        motion(poses=np.zeros((3, 24)))
    with pytest.raises(MotionError, match=r"Markers.positions must have shape \(\.\.\., n, 2, 3\)"):
        Markers(["a", "b"], np.zeros((4, 3, 3)), 30)
    with pytest.raises(MotionError, match="Motion.poses must be numeric"):
        motion(poses=[["x"] * 25])
    with pytest.raises(MotionError, match="Cycles.subject must hold 2 labels, got 1"):
        Cycles(np.zeros((2, 4, 1)), ["a"], [1, 1], [0, 0], ["p"])


def test_arrays_can_not_be_changed_from_outside_or_inside():
    poses = np.zeros((3, 25))
    made = motion(poses=poses)
    poses[:] = 7
    assert (made.poses == 0).all()
    with pytest.raises(ValueError, match="read-only"):
        made.poses[0, 0] = 1


def test_parents_come_before_their_children():
    with pytest.raises(MotionError, match="each -1 or of an earlier joint"):
        Markers(["a", "b"], np.zeros((1, 2, 3)), 30, parents=(1, -1))


def test_a_missing_point_lists_what_there_is():
    with pytest.raises(MotionError, match="there is no point 'c'; available are a, b"):
        Markers(["a", "b"], np.zeros((1, 2, 3)), 30).index("c")


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"R": 2 * np.eye(3)}, "rotation matrix"),
        ({"R": np.diag([1.0, 1, -1])}, "rotation matrix"),
        ({"t": [0, 0, np.nan]}, "must be finite"),
        ({"width": 0}, "Camera.width"),
        ({"height": 2.5}, "Camera.height"),
    ],
)
def test_impossible_cameras_are_refused(changes, match):
    with pytest.raises(MotionError, match=match):
        Camera(**{"K": K, "R": np.eye(3), "t": np.zeros(3), "width": 64, "height": 48} | changes)


def test_projection_by_hand():
    camera = Camera(K, np.eye(3), [0, 0, 2], 64, 48)
    pixels, depth = camera.project([[0.0, 0, 0], [1.0, -0.5, 2.0]])
    assert np.allclose(pixels, [[31.5, 23.5], [31.5 + 100 / 4, 23.5 - 50 / 4]])
    assert np.allclose(depth, [2, 4])
    assert np.allclose(camera.centre, [0, 0, -2])


def test_pickles_whole_and_still_read_only():
    made = pickle.loads(pickle.dumps(motion(name="walk")))
    assert (made.name, made.fps) == ("walk", 30)
    assert not made.poses.flags.writeable
    error = pickle.loads(pickle.dumps(FormatError("walk.bvh", "ends in the middle", "line 7")))
    assert str(error) == "walk.bvh, line 7: ends in the middle"


def test_seconds_and_angles():
    made = motion(poses=np.arange(75.0).reshape(3, 25))
    assert made.seconds == pytest.approx(0.1)
    assert made.angles.shape == (3, 19)
    assert made.angles[0, 0] == 6


def test_confidence_is_one_number_per_point_from_0_to_1():
    positions = np.zeros((4, 15, 2))
    given = np.linspace(0, 1, 60).reshape(4, 15)
    given[0, 0] = np.nan
    np.testing.assert_array_equal(Points(positions, 30, "px", confidence=given).confidence, given)
    for wrong, match in ((given[:, :3], "must have shape"), (2 * given, "from 0 to 1"), (given - 1, "from 0 to 1")):
        with pytest.raises(MotionError, match=match):
            Points(positions, 30, "px", confidence=wrong)
