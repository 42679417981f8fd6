"""`POST /v1/lift` against `motionenv.lift` and the truth."""

import math

import numpy as np
import pytest

import motionenv
from motionenv.lifting import project_markers


@pytest.fixture(scope="module")
def points():
    """What a camera at 40 degrees sees of an eigenwalker, 3 s."""
    return project_markers(motionenv.load("walk/eigenwalkers").synthesize_markers(3.0, 30, seed=5), math.radians(40.0))


def asked(points, **more):
    gaps = np.where(np.isfinite(points.positions), points.positions, None).tolist()
    return {"points": gaps, "fps": points.fps, "unit": points.unit} | more


def test_the_walk_is_the_one_that_python_lifts(server, points):
    told = server.http.post("/v1/lift", json=asked(points)).json()
    found = motionenv.lift(points)
    np.testing.assert_allclose(told["positions"], found.markers().positions, atol=1e-9)
    np.testing.assert_allclose(told["poses"], found.motion().poses, atol=1e-9)
    assert told["steady"]["view"] == pytest.approx(math.degrees(found.posterior.alpha), abs=1e-9)


def test_the_view_is_found_with_points_missing(server, points):
    positions = points.positions.copy()
    positions[::3, 4] = np.nan
    body = asked(motionenv.Points(positions, points.fps, points.unit))
    body["points"][5] = [None] * 15
    told = server.http.post("/v1/lift", json=body).json()
    views = [told["steady"]["view"], *(other["view"] for other in told["steady"]["others"])]
    assert min(abs((v - 40 + 180) % 360 - 180) for v in views) < 5
    assert told["plausible"]


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ({"fps": 0}, "/fps"),
        ({"unit": "cm"}, "/unit"),
        ({"view": 1e9}, "/view"),
        ({"points": [[[0, 0]] * 15] * 5}, "/points"),
    ],
)
def test_what_is_wrong_is_told(server, points, more, field):
    answer = server.http.post("/v1/lift", json=asked(points) | more)
    assert answer.status_code == 422
    assert field in [error["field"] for error in answer.json()["errors"]]


def test_what_is_no_walk_is_told(server):
    still = {"points": [[[10.0, 10.0]] * 15] * 60, "fps": 30.0}
    answer = server.http.post("/v1/lift", json=still)
    assert answer.status_code == 422
    assert answer.json()["detail"]
