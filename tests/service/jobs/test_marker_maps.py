"""Capture with names of a laboratory's own: its points are listed, and a marker map says which landmarks they are."""

import io

import numpy as np
import pytest

import motionenv
from motionenv.mocap import LANDMARKS, MarkerMap
from motionenv.types import MARKERS, POSE
from tests.service.jobs.handing import ODD, as_c3d, ended, odd_map, odd_points, result, uploads

LEGS = tuple(marker for marker in MARKERS if marker == "pelvis" or marker.endswith(("hip", "knee", "ankle")))
ANGLES = [POSE.index(f"{side}_{angle}") for side in ("left", "right") for angle in ("hip_flexion", "knee_flexion")]
BVH = {"format": "model/x-bvh"}
UPPER = slice(POSE.index("neck_flexion"), POSE.index("left_hip_flexion"))


@pytest.fixture(scope="module")
def walk():
    return motionenv.synthesize("walk/fpca", 5, 60, seed=3, speed=1.2, variation=0)


def done(server, kind: str, content: bytes, **fields):
    """The result of a job on one C3D file."""
    asked = server.http.post(f"/v1/jobs/{kind}", files=uploads({"odd.c3d": content}), data=fields)
    return result(server, ended(server, asked))


def test_points_are_listed_with_a_frame_that_shows_them(job_server, walk):
    names, positions = odd_points(walk)
    positions[:7, :4] = np.nan
    positions[:, 14] = np.nan
    told = done(job_server, "points", as_c3d(names, positions, 60)).json()
    assert told["points"] == names
    assert (told["frame"], told["positions"][14]) == (7, None)
    np.testing.assert_allclose(told["positions"][:14], positions[7, :14], atol=1e-4)
    assert told["heading"] == pytest.approx(0, abs=5)
    assert (told["marker_set"], told["landmarks"]) == (None, LANDMARKS)
    assert told["problem"]
    assert (told["map"], told["assigned"], told["unfound"]) == (None, {}, [])


def test_who_stays_has_no_heading_and_what_has_no_points_is_told_so(job_server, walk):
    names, positions = odd_points(walk)
    positions[..., :2] -= positions[:, 2:3, :2]
    assert done(job_server, "points", as_c3d(names, positions, 60)).json()["heading"] is None
    content = b"".join(motionenv.mocap.encode(walk, ".npz"))
    job = ended(job_server, job_server.http.post("/v1/jobs/points", files=uploads({"walk.npz": content})))
    assert (job["status"], job["error"]["status"]) == ("failed", 422)
    assert "needs no marker map" in job["error"]["detail"]


def test_a_map_makes_a_motion_of_any_names(job_server, walk):
    content = as_c3d(*odd_points(walk), 60)
    (unknown,) = done(job_server, "inspect", content).json()["files"]
    assert unknown["points"] == list(ODD.values())
    assert unknown.get("motion") is None
    job = ended(job_server, job_server.http.post("/v1/jobs/convert", files=uploads({"odd.c3d": content}), data=BVH))
    for problem in (unknown["problem"], job["error"]["detail"]):
        assert "send a marker map in the field map" in problem
        assert "--map" not in problem
    (known,) = done(job_server, "inspect", content, map=odd_map()).json()["files"]
    found = np.array(known["motion"]["poses"], dtype=float)
    np.testing.assert_allclose(found[:, ANGLES], walk.poses[::2][:, ANGLES], atol=np.radians(3))
    assert known["walk"]["speed"] == pytest.approx(1.2, abs=0.1)
    converted = done(job_server, "convert", content, map=odd_map(), format="application/x-npz").content
    with np.load(io.BytesIO(converted)) as made:
        np.testing.assert_allclose(made["poses"][::2], found, atol=1e-12)
    told = done(job_server, "points", content, map=odd_map() + 'c7 = "none"\n').json()
    assert (told["problem"], told["unfound"]) == (None, ["c7"])
    assert told["assigned"] == {marker: {ODD[marker]: 1.0} for marker in MARKERS}
    assert MarkerMap.parse(told["map"]).points["head"] == ({"Dot0": 1.0},)


def test_legs_alone_have_null_for_the_rest(job_server, walk):
    content = as_c3d(*odd_points(walk, LEGS), 60)
    (found,) = done(job_server, "inspect", content, map=odd_map(LEGS)).json()["files"]
    poses = np.array(found["motion"]["poses"], dtype=float)
    assert np.isnan(poses[:, UPPER]).all()
    error = np.degrees(np.abs(poses - walk.poses[::2])[:, ANGLES]).max(axis=0)
    assert max(error[1::2]) < 3, "knees"
    assert max(error[::2]) < 6, "hips, beside a pelvis whose tilt was not captured"


def test_models_are_fitted_with_a_map(job_server, walk):
    sent = uploads({f"a_{i}.c3d": as_c3d(*odd_points(walk), 60) for i in range(2)})
    for kind in ("fpca", "tree"):
        data = {"kind": kind, "name": f"odd-{kind}", "map": odd_map()}
        job = ended(job_server, job_server.http.post("/v1/models", files=sent, data=data))
        assert result(job_server, job).json()["used"] == ["a_0.c3d", "a_1.c3d"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[points\n", "line 1"),
        ('[points]\nleft_kneecap = "K"\n', "left_kneecap"),
        ("[points]\nleft_knee = 3\n", "left_knee"),
        ("[points]\nleft_knee = " + "[" * 10_000, ""),
        ("", ""),
    ],
)
@pytest.mark.parametrize("path", ["jobs/inspect", "jobs/points", "jobs/report"])
def test_what_is_no_map_is_refused_before_a_job_begins(job_server, path, text, expected):
    before = job_server.http.get("/v1/jobs").json()
    answer = job_server.http.post(f"/v1/{path}", files=uploads({"odd.c3d": b"\x02\x50"}), data={"map": text})
    problem = answer.json()
    assert (answer.status_code, answer.headers["Content-Type"]) == (422, "application/problem+json")
    assert expected in problem["detail"]
    if text and len(text) <= 32_768:
        assert problem["errors"][0]["field"] == "/map"
    assert job_server.http.get("/v1/jobs").json() == before


def test_a_gait_laboratorys_legs_need_no_map(job_server, mocap):
    """Plug-in Gait's lower body, of BTK's samples."""
    content = (mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d").read_bytes()
    told = done(job_server, "points", content).json()
    assert told["problem"] is None
    assert told["marker_set"]
    assert set(told["assigned"]) == set(MarkerMap.parse(told["map"]).points)
    assert told["assigned"]["left_asis"] == {next(name for name in told["points"] if name.endswith("LASI")): 1.0}
    (found,) = done(job_server, "inspect", content).json()["files"]
    poses = np.array(found["motion"]["poses"], dtype=float)
    assert np.isnan(poses[:, UPPER]).all()
    assert np.isfinite(poses[:, ANGLES]).mean() > 0.5
