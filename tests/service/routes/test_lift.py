"""`POST /v1/lift` against `motionenv.lift` and the truth."""

import math

import numpy as np
import pytest

import motionenv
from motionenv.body import markers
from motionenv.gait import feet_of
from motionenv.lifting import gait_of, project_markers
from motionenv.metrics import pelvis_mpjpe
from motionenv.models.paths import WalkPath
from motionenv.render.cameras import fit_view
from tests.models.eigenwalkers.walks import made_markers


@pytest.fixture(scope="module")
def points():
    """What a camera at 40 degrees sees of an eigenwalker, 3 s."""
    return project_markers(made_markers(motionenv.load("walk/eigenwalkers"), 3.0, 30, seed=5), math.radians(40.0))


def asked(points, **more):
    gaps = np.where(np.isfinite(points.positions), points.positions, None).tolist()
    return {"points": gaps, "fps": points.fps, "unit": points.unit} | more


def test_the_walk_is_the_one_that_python_lifts(server, points):
    told = server.http.post("/v1/lift", json=asked(points)).json()
    found = motionenv.lift(points)
    np.testing.assert_allclose(told["positions"], found.markers().positions, atol=1e-9)
    np.testing.assert_allclose(told["poses"], found.motion().poses, atol=1e-9)


def test_points_may_be_missing(server, points):
    positions = points.positions.copy()
    positions[::3, 4] = np.nan
    body = asked(motionenv.Points(positions, points.fps, points.unit))
    body["points"][5] = [None] * 15
    told = server.http.post("/v1/lift", json=body).json()
    assert pelvis_mpjpe(np.array(told["positions"]), points.truth.positions).mean() < 0.04
    assert told["plausible"]


def test_a_camera_and_confidences_are_used(server):
    walk = motionenv.synthesize("walk/fpca", 3.0, 30, seed=4, path=WalkPath.arc(1.6, 60.0), speed=1.1)
    places = markers(walk.poses, walk.skeleton)
    camera = fit_view(places, 0.4, width=640, height=480, elevation=0.12)
    confidence = np.random.default_rng(0).uniform(0.5, 1, places.shape[:2])
    seen = motionenv.Points(camera.project(places)[0], 30.0, "px", confidence=confidence)
    pose = {"R": camera.R.tolist(), "t": camera.t.tolist()}
    body = asked(seen)
    body["points"] = np.concatenate([seen.positions, confidence[..., None]], axis=-1).tolist()
    for known, field, lens in (
        (camera, pose, None), ([camera] * 90, {"poses": [pose] * 90}, None), (camera.K, {}, [0.01, 0, 0, 0]),
    ):  # fmt: skip
        body["camera"] = {"K": camera.K.tolist(), "distortion": lens, **field}
        there = server.http.post("/v1/lift", json=body).json()
        here = motionenv.lift(seen, camera=known, distortion=lens)
        np.testing.assert_allclose(there["positions"], here.positions, atol=1e-9)
        np.testing.assert_allclose(there["band"], here.band, atol=1e-9)
    body["camera"] = {"K": camera.K.tolist(), "poses": [pose] * 2}
    assert "one pose for each of the 90 frames, got 2" in server.http.post("/v1/lift", json=body).text


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ({"fps": 0}, "/fps"),
        ({"unit": "cm"}, "/unit"),
        ({"height": 1e9}, "/height"),
        ({"points": [[[0, 0]] * 15] * 5}, "/points"),
        ({"camera": {"K": np.eye(3).tolist(), "t": [0, 0, 0]}}, "/camera/R"),
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


def test_gait_is_told_if_it_is_asked_for(server):
    walk = motionenv.synthesize("walk/fpca", 3.0, 30, seed=4)
    places = markers(walk.poses, walk.skeleton)
    camera = fit_view(places, 0.2, width=640, height=480)
    feet = feet_of(walk)
    ends = np.stack([getattr(feet, part)[side] for side in ("left", "right") for part in ("heel", "toe")], axis=1)
    seen = motionenv.Points(camera.project(places)[0], 30.0, "px", feet=camera.project(ends)[0])
    body = asked(seen, feet=seen.feet.tolist(), height=1.8, gait=True)
    told = server.http.post("/v1/lift", json=body).json()["gait"]
    here = gait_of(motionenv.lift(seen, height=1.8))
    np.testing.assert_allclose(told["angles"]["left_ankle_dorsiflexion"]["degrees"], here["left_ankle_dorsiflexion"])
    np.testing.assert_allclose(told["angles"]["left_knee_flexion"]["high"], here.band("left_knee_flexion")[1])
    assert [event["time"] for event in told["events"]] == pytest.approx([event.time for event in here.events])
    assert told["page"].startswith("<!doctype html>")
    assert server.http.post("/v1/lift", json=body | {"feet": body["feet"][:5]}).status_code == 422
    assert server.http.post("/v1/lift", json=asked(seen)).json()["gait"] is None
