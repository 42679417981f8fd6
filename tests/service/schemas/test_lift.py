"""Points that may be sent are points that the library takes; its answers fit the schema."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

import motionenv
from motionenv import MotionError
from motionenv.lifting import project_markers
from motionenv.types import MARKERS, POSE
from service.routes.lift import to_response
from service.schemas.lift import LiftRequest, LiftResponse


@pytest.fixture(scope="module")
def points() -> motionenv.Points:
    """What a camera at 40 degrees sees of an eigenwalker, 3 s."""
    walk = motionenv.load("walk/eigenwalkers").synthesize_markers(3.0, 30, seed=5)
    return project_markers(walk, math.radians(40.0))


def test_an_answer_of_the_library_fits_the_schema(points):
    told = to_response(motionenv.lift(points, math.radians(40.0)))
    plain = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in told.items()}
    fitted = LiftResponse(**plain)
    assert set(plain) == set(LiftResponse.model_fields)
    assert (tuple(fitted.markers), tuple(fitted.pose)) == (MARKERS, POSE)
    assert fitted.steady.view == pytest.approx(40.0)
    assert np.shape(fitted.positions) == np.shape(fitted.band) == (90, 15, 3)


def test_markers_are_told_in_the_order_of_the_library():
    words = LiftRequest.model_fields["points"].description.replace(",", "").replace(":", "").split()
    singles = [word for word in words if word in MARKERS]
    pairs = [word for word in words if f"left_{word}" in MARKERS]
    told = [*singles, *(f"{side}_{word}" for word in pairs for side in ("left", "right"))]
    assert told == list(MARKERS)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"points": 7}, "points"),
        ({"points": [[[0.0, 0.0]] * 14] * 30}, "points"),
        ({"fps": 0.5}, "fps"),
        ({"fps": 1001.0}, "fps"),
        ({"unit": "cm"}, "unit"),
        ({"view": 361.0}, "view"),
        ({"elevation": 86.0}, "elevation"),
        ({"elevation": "some"}, "elevation"),
        ({"scale": 0.0}, "scale"),
        ({"robust": 1}, "robust"),
    ],
)
def test_what_is_wrong_is_refused_by_its_field(points, change, field):
    whole = {"points": points.positions.tolist(), "fps": 30.0, "unit": "m"}
    assert LiftRequest(**whole).points
    if change.get("points") == 7:
        change = {"points": whole["points"][:7]}
    with pytest.raises(ValidationError) as refused:
        LiftRequest(**whole | change)
    assert refused.value.errors()[0]["loc"][0] == field


def test_what_the_library_refuses_too(points):
    whole = {"points": points.positions.tolist(), "fps": 30.0, "unit": "m", "scale": 100.0}
    with pytest.raises(ValidationError, match="scale is only for points in pixels"):
        LiftRequest(**whole)
    with pytest.raises(MotionError, match="scale"):
        motionenv.lift(points, 0.5, scale=100.0)
    with pytest.raises(MotionError, match="unit"):
        motionenv.Points(points.positions, 30.0, "cm")
    with pytest.raises(MotionError, match="elevation"):
        motionenv.lift(points, 0.5, elevation=math.radians(91))
