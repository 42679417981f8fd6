"""Errors cross process borders whole, and can be caught at every level."""

import pickle

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
