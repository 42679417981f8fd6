"""Errors cross process borders whole, and can be caught at every level."""

import pickle

import numpy as np
import pytest

from motionenv.errors import EngineError, FormatError, GapError, ModelError, MotionError


@pytest.mark.parametrize("kind", [EngineError, FormatError, GapError, ModelError])
def test_every_error_is_one_of_ours_and_a_value_error(kind):
    assert issubclass(kind, MotionError)
    assert issubclass(kind, ValueError)


@pytest.mark.parametrize("where", ["", "line 3"])
def test_a_format_error_names_file_and_place_also_after_pickling(where):
    error = FormatError("walks/a.bvh", "must be a number, got 'x'", where)
    place = "walks/a.bvh, line 3" if where else "walks/a.bvh"
    again = pickle.loads(pickle.dumps(error))
    for each in (error, again):
        assert str(each) == f"{place}: must be a number, got 'x'"
        assert (each.path, each.where, each.problem) == ("walks/a.bvh", where, "must be a number, got 'x'")


@pytest.mark.parametrize("kind", [MotionError, GapError, ModelError, EngineError])
def test_plain_errors_survive_pickling_as_what_they_are(kind):
    again = pickle.loads(pickle.dumps(kind("fill the gap")))
    assert (type(again), str(again)) == (kind, "fill the gap")


@pytest.mark.parametrize(
    "scalar", [np.float64(3.5), np.float32(-0.5), np.int64(7), np.uint8(9), np.bool_(True), np.nan]
)
def test_numpys_scalars_are_written_as_plain_numbers(scalar):
    """NumPy 2 writes np.float64(3.5), which says nothing to who sent 3.5 in JSON."""
    plain = f"speed must be [{scalar.item() if isinstance(scalar, np.generic) else scalar!r}], see np.load(file)"
    assert str(MotionError(f"speed must be {[scalar]!r}, see np.load(file)", "speed")) == plain


def test_an_error_keeps_the_arguments_that_it_names_between_processes():
    error = pickle.loads(pickle.dumps(MotionError("give one of speed and speeds", "speed", "speeds")))
    assert (str(error), error.fields) == ("give one of speed and speeds", ("speed", "speeds"))
    assert MotionError("a motion").fields == ()
