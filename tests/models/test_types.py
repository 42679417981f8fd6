"""What goes into models and comes out of them: values that compare, requests that are checked."""

import numpy as np
import pytest

from motionenv.arguments import Request
from motionenv.errors import MotionError
from motionenv.models.types import Components, Target, Walker


def test_walkers_with_equal_numbers_are_equal_whatever_held_them():
    walker = Walker("fpca", np.array([1, 2], dtype=np.int32), 1.1)
    assert walker == Walker("fpca", [1.0, 2.0], 1.1)
    assert all(type(score) is float for score in walker.scores)
    assert len({walker, Walker("fpca", (1, 2), 1.1), Walker("fpca", (1, 2))}) == 2


def test_components_are_as_many_as_their_means_and_numbered_from_one():
    assert Components(np.zeros(2), np.ones(2), np.ones(2)).names == ("component 1", "component 2")
    assert len(Components()) == 0
    assert Components().names == ()


@pytest.mark.parametrize(("seconds", "fps", "frames"), [(2, 30, 60), (0.99, 30, 30), (0.04, 24, 1), (3600, 99, 356400)])
def test_a_request_has_the_nearest_number_of_frames(seconds, fps, frames):
    assert Request(seconds, fps).frames == frames


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fps": 0.5}, r"fps must be a number.* from 1 to 1000, got 0\.5"),
        ({"seconds": 0.0}, r"seconds must be a number of seconds above 0 and at most 3600, got 0\.0"),
        ({"seconds": 3601}, r"seconds must be .* at most 3600, got 3601"),
        ({"seconds": 0.01}, r"seconds must last one frame at least, got 0\.01 at 30 fps"),
        ({"speed": 3.5}, r"speed must be a number of .* from 0\.1 to 3, got 3\.5"),
        ({"height": 0.4}, r"height must be a number of metres from 0\.5 to 2\.5, got 0\.4"),
        ({"phase": np.inf}, r"phase must be a number of cycles from -1000 to 1000, got inf"),
        ({"variation": 11}, "variation must be a number from 0 to 10, got 11"),
        ({"variation": True}, "variation must be a number from 0 to 10, got True"),
    ],
)
def test_a_request_out_of_range_is_told_what_may_be(given, says):
    with pytest.raises(MotionError, match=says):
        Request(**{"seconds": 1.0, "fps": 30.0} | given)


def test_a_target_may_leave_all_free_but_not_go_backwards():
    assert Target() == Target(None, None, None)
    with pytest.raises(MotionError, match=r"speed must be a number of m/s from 0, got -1"):
        Target(speed=-1)
    with pytest.raises(MotionError, match="heading must be a finite number of radians, got nan"):
        Target(heading=np.nan)
