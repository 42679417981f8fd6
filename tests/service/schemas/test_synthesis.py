"""Bounds of a request for motion: the library takes what they allow, and where they are its own, nothing beyond."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

import motionenv
from motionenv import MotionError
from service.formats.films import arguments
from service.schemas.synthesis import MotionResponse, Picture, SynthesisRequest

FIELDS = SynthesisRequest.model_json_schema()["properties"]


def bounds(schema: dict) -> tuple[float, float]:
    (number,) = [part for part in schema.get("anyOf", [schema]) if "minimum" in part]
    return number["minimum"], number["maximum"]


def inside(name: str) -> st.SearchStrategy:
    low, high = bounds(FIELDS[name])
    return st.floats(low, high) | st.sampled_from([low, high])


@settings(max_examples=50, deadline=None)  # the first example may compile
@given(st.fixed_dictionaries({name: inside(name) for name in ("speed", "height", "phase", "variation", "fps")}),
       st.lists(st.floats(-5, 5), max_size=8), st.floats(0.02, 0.5), st.integers(0, 2**63 - 1))  # fmt: skip
def test_what_is_taken_is_made(how, deviations, seconds, seed):
    seconds = max(seconds, 1 / how["fps"])
    asked = SynthesisRequest(**how, deviations=deviations, seconds=seconds, seed=seed)
    motion = asked.make(asked.model, seed)
    assert len(motion.poses) == asked.frames
    assert np.isfinite(motion.poses).all()
    assert motion.skeleton.height == asked.height


@pytest.mark.parametrize("name", ["speed", "height", "variation"])
def test_bounds_are_those_of_the_library(name):
    low, high = bounds(FIELDS[name])
    for value in (np.nextafter(low, -np.inf), np.nextafter(high, np.inf)):
        with pytest.raises(ValidationError) as refused:
            SynthesisRequest(**{name: float(value)})
        assert refused.value.errors()[0]["loc"] == (name,)
        with pytest.raises(MotionError, match=f"{name} must be a number .* to {high:g}, got"):
            motionenv.synthesize("walk/fpca", 0.1, 30, **{name: float(value)})


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"seconds": 0.01, "fps": 1.0}, "seconds · fps must be at least one frame"),
        ({"deviations": [1.0], "scores": [1.0]}, "give either deviations or scores, not both"),
    ],
)
def test_what_the_library_refuses_too_is_refused_in_words(asked, says):
    with pytest.raises(ValidationError, match=says):
        SynthesisRequest(**asked)
    how = {"seconds": 1.0, "fps": 30.0, **asked}
    with pytest.raises(MotionError):
        motionenv.synthesize("walk/fpca", how.pop("seconds"), how.pop("fps"), seed=0, **how)


@pytest.mark.parametrize("at", [0, 1])
def test_pictures_at_the_bounds_are_drawn(at):
    fields = Picture.model_json_schema()["properties"]
    extreme = {name: float(bounds(fields[name])[at]) for name in ("view", "elevation")}
    shown = Picture(width=16, height=16, colour=[at] * 3, background=[1 - at] * 3, **extreme)
    motion = motionenv.synthesize("walk/fpca", 0.1, 30, seed=0)
    drawn = list(motionenv.film(motion, **arguments(shown)))
    assert [picture.shape for picture in drawn] == [(16, 16, 3)] * 3
    assert arguments(shown)["alpha"] == pytest.approx(math.radians(extreme["view"]))


def test_a_motion_as_an_answer_has_every_field(tmp_path):
    motion = motionenv.synthesize("walk/fpca", 0.1, 30, seed=0)
    body = motion.skeleton
    told = MotionResponse(
        model="walk/fpca", seed=0, fps=motion.fps, height=body.height, pose=list(motionenv.types.POSE),
        poses=motion.poses.tolist(), offsets=body.offsets.tolist(), radii=body.radii.tolist(),
    )  # fmt: skip
    np.testing.assert_array_equal(told.poses, motion.poses)
    with pytest.raises(ValidationError, match="at least 25"):
        MotionResponse(**told.model_dump() | {"poses": [[0.0] * 24]})
