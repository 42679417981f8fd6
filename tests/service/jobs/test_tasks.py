"""The work of jobs on a real service: fitting, inspecting, converting, rendering."""

import io
import json
import shutil
import unicodedata
from urllib.parse import unquote

import numpy as np
import pytest

import motionenv
from motionenv.models import training
from motionenv.types import MARKERS, POSE
from tests.service.jobs.handing import as_file, ended, result, some_walks, uploads


@pytest.fixture(scope="module")
def walks() -> dict[str, bytes]:
    return some_walks()


def test_inspecting_finds_the_body_and_the_cycles(job_server, walks):
    motion = motionenv.synthesize("walk/fpca", 5, 60, seed=0, variation=0)
    sent = uploads({"a walk.npz": as_file(motion, ".npz"), "b.bvh": b"no"})
    asked = job_server.http.post("/v1/jobs/inspect", files=sent)
    found = result(job_server, ended(job_server, asked)).json()
    walk, broken = found["files"]
    assert (walk["name"], walk["format"], walk["frames"], walk["fps"]) == ("a-walk.npz", "npz", 300, 60)
    assert found["pose"] == list(POSE)
    assert walk["problem"] is None if "problem" in walk else True
    np.testing.assert_allclose(walk["motion"]["poses"], motion.poses[::2])
    assert walk["motion"]["height"] == pytest.approx(motion.skeleton.height)
    steps = np.diff(walk["walk"]["starts"])
    np.testing.assert_allclose(steps, walk["walk"]["stride"])
    ahead = motion.poses[:, POSE.index("left_hip_flexion")] - motion.poses[:, POSE.index("right_hip_flexion")]
    peaks = [i / 60 for i in range(20, 280) if ahead[i] == ahead[i - 20 : i + 21].max()]
    assert abs(np.mean(np.diff(peaks)) - walk["walk"]["stride"]) < 0.02
    assert all(
        min(abs(start - peak) for peak in peaks) < 0.1
        for start in walk["walk"]["starts"]
        if peaks[0] < start < peaks[-1]
    )
    assert broken["name"] == "b.bvh"
    assert "b.bvh" in broken["problem"]
    assert str(job_server.data) not in json.dumps(found)


def test_one_of_two_people_is_read(job_server):
    """A table of two walkers, of whom Ben shows the legs; the reader's note is in the answer."""
    walk = motionenv.synthesize("walk/fpca", 2, 60, seed=0)
    anna = motionenv.body.markers(walk.poses, walk.skeleton)
    legs = [name for name in MARKERS if name.endswith(("hip", "knee", "ankle"))]
    points = {f"Anna:{name}": anna[:, i] for i, name in enumerate(MARKERS)}
    points |= {f"Ben:{name}": anna[:, MARKERS.index(name)] + 1 for name in legs}
    lines = [",".join(["time", *(f"{name}_{axis}_m" for name in points for axis in "xyz")])]
    for i in range(len(anna)):
        lines.append(",".join(map(str, [i / 60, *(x for place in points.values() for x in place[i])])))
    sent = uploads({"two.csv": "\n".join(lines).encode()})
    for person, many in (("", len(MARKERS)), ("Ben", len(legs))):
        data = {"person": person} if person else {}
        asked = job_server.http.post("/v1/jobs/inspect", files=sent, data=data)
        (found,) = result(job_server, ended(job_server, asked)).json()["files"]
        assert len(found["points"]) == many
        assert f"{person or 'Anna'} is taken" in found["notes"][0]
        assert found["motion"]["height"] > 1.2


def test_models_are_fitted_used_and_removed(job_server, walks):
    asked = job_server.http.post("/v1/models", files=uploads(walks), data={"kind": "eigenwalkers", "name": "ours"})
    job = ended(job_server, asked)
    told = result(job_server, job).json()
    assert (job["model"], told["model"], told["kind"]) == ("fitted/ours", "fitted/ours", "eigenwalkers")
    assert told["used"] == sorted(walks)
    assert (told["card"]["people"], told["card"]["trials"]) == (4, 8)
    again = job_server.http.post("/v1/models", files=uploads(walks), data={"kind": "eigenwalkers", "name": "ours"})
    assert again.status_code == 409
    body = {"model": "fitted/ours", "seed": 3, "seconds": 1}
    poses = job_server.http.post("/v1/synthesis", json=body).raise_for_status().json()["poses"]
    model = motionenv.load(job_server.data / "models" / "ours.npz")
    np.testing.assert_allclose(poses, motionenv.synthesize(model, 1, 30, seed=3).poses)
    assert "fitted/ours" in job_server.http.get("/v1/models").text
    assert job_server.http.delete("/v1/models/fitted/ours").status_code == 204
    assert job_server.http.delete("/v1/models/fitted/ours").status_code == 404
    assert job_server.http.post("/v1/synthesis", json=body).status_code == 404


def test_the_other_kinds_of_models_learn_too(job_server, walks):
    tree = job_server.http.post(
        "/v1/models", files=uploads(walks), data={"kind": "tree", "name": "t", "activity": "walk"}
    )
    fpca = job_server.http.post("/v1/models", files=uploads(walks), data={"kind": "fpca", "name": "f"})
    assert result(job_server, ended(job_server, tree)).json()["card"]["activities"] == "walk"
    assert result(job_server, ended(job_server, fpca)).json()["kind"] == "walking"
    asked = {"model": "fitted/t", "start": "walk", "n": 3, "seed": 1}
    assert len(job_server.http.post("/v1/tree/samples", json=asked).raise_for_status().json()["poses"]) == 3


def test_real_capture_is_fitted_as_the_command_does(job_server, mocap):
    trials = ("07_01", "07_02", "35_01", "35_02", "16_15")
    folder = mocap / "cmu_asfamc"
    files = {f"{t}.amc": (folder / t[:2] / f"{t}.amc").read_bytes() for t in trials}
    files |= {f"{s}.asf": (folder / s / f"{s}.asf").read_bytes() for s in ("07", "35", "16")}
    asked = job_server.http.post("/v1/models", files=uploads(files), data={"kind": "fpca", "name": "cmu", "fps": "120"})
    told = result(job_server, ended(job_server, asked)).json()
    assert told["card"]["people"] == 3
    assert told["card"]["data"].startswith("overground walks of the CMU")
    expected = training.fit("walk/fpca", training.read_walks(_copied(folder, trials, job_server.data), fps=120), "")
    got = motionenv.load(job_server.data / "models" / "cmu.npz")
    np.testing.assert_allclose(got.person_mean_, expected.person_mean_, rtol=1e-4, atol=1e-6)


def _copied(folder, trials, data):
    to = data.parent / "copied"
    for trial in trials:
        (to / trial[:2]).mkdir(parents=True, exist_ok=True)
        for name in (f"{trial[:2]}/{trial}.amc", f"{trial[:2]}/{trial[:2]}.asf"):
            shutil.copy(folder / name, to / name)
    return to


def test_people_of_any_alphabet_are_people(job_server, walks):
    """Two trials of each: by the first letters alone, or by Latin ones, there would be one person."""
    people = {"p0": "Пётр", "p1": "Иван", "p2": "山田", "p3": "Zoe\u0308"}
    named = {f"{people[name[:2]]}{name[2:]}": content for name, content in walks.items()}
    asked = job_server.http.post(
        "/v1/models", files=uploads(named), data={"kind": "eigenwalkers", "name": "of-any-alphabet"}
    )
    job = ended(job_server, asked)
    told = result(job_server, job).json()
    assert told["card"]["people"] == 4
    assert set(told["used"]) == {unicodedata.normalize("NFC", name) for name in named}
    asked = job_server.http.post(
        "/v1/jobs/convert", files=uploads({"Пётр_0.npz": walks["p0_0.npz"]}), data={"format": "text/csv"}
    )
    answer = result(job_server, ended(job_server, asked))
    said = answer.headers["Content-Disposition"]
    assert said.startswith("attachment; filename*=utf-8''")
    assert unquote(said.rpartition("''")[2]) == "Пётр_0.csv"


def test_a_unit_for_all_files_is_only_for_those_that_state_none(job_server):
    motion = motionenv.synthesize("walk/fpca", 2, 60, seed=5, height=1.75)
    files = {"a.c3d": as_file(motion, ".c3d"), "b.npz": as_file(motion, ".npz")}
    asked = job_server.http.post("/v1/jobs/inspect", files=uploads(files), data={"unit": "m", "fps": "30"})
    for found in result(job_server, ended(job_server, asked)).json()["files"]:
        assert found["fps"] == 60
        assert 1.5 < found["motion"]["height"] < 2.0, found["name"]


@pytest.mark.parametrize("suffix", [".bvh", ".c3d"])
def test_conversion_keeps_the_motion(job_server, suffix):
    motion = motionenv.synthesize("walk/fpca", 2, 60, seed=5)
    given = uploads({f"walk{suffix}": as_file(motion, suffix)})
    asked = job_server.http.post("/v1/jobs/convert", files=given, data={"format": "application/x-npz"})
    answer = result(job_server, ended(job_server, asked))
    assert answer.headers["Content-Type"] == "application/x-npz"
    assert answer.headers["Content-Disposition"] == 'attachment; filename="walk.npz"'
    with np.load(io.BytesIO(answer.content)) as made:
        hips = [POSE.index("left_hip_flexion"), POSE.index("right_hip_flexion")]
        assert np.abs(made["poses"][:, hips] - motion.poses[:, hips]).max() < 0.2
    tag = answer.headers["ETag"]
    assert job_server.http.get(answer.url, headers={"If-None-Match": tag}).status_code == 304


def test_a_rendered_video_is_that_of_python(job_server, tmp_path):
    body = {"seconds": 1, "seed": 2, "picture": {"width": 64, "height": 48, "view": 0}, "format": "image/gif"}
    answer = result(job_server, ended(job_server, job_server.http.post("/v1/jobs/render", json=body)))
    motion = motionenv.synthesize("walk/fpca", 1, 30, seed=2)
    frames = motionenv.film(motion, 0.0, width=64, height=48, elevation=np.radians(3.5))
    motionenv.write_video(tmp_path / "f.gif", frames, 30)
    assert answer.content == (tmp_path / "f.gif").read_bytes()


def test_lower_bodies_are_filled_on_request(job_server):
    motion = motionenv.synthesize("walk/fpca", 2, 30, seed=0)
    poses = motion.poses.copy()
    poses[:, 6:17] = np.nan
    lower = motionenv.Motion(poses, motion.skeleton, motion.fps)
    told = {}
    for fill in ("false", "true"):
        form = {"format": "application/json", "fill": fill}
        asked = job_server.http.post("/v1/jobs/convert", files=uploads({"a.npz": as_file(lower, ".npz")}), data=form)
        told[fill] = result(job_server, ended(job_server, asked)).json()
    assert "filled" not in told["false"]
    np.testing.assert_array_equal(np.array(told["false"]["poses"], dtype=float), poses)
    np.testing.assert_allclose(told["true"]["poses"], motionenv.fill(lower).poses, atol=1e-9)
    np.testing.assert_array_equal(told["true"]["filled"], np.isnan(poses))
