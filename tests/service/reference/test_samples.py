"""Every sample of the reference runs as it is printed, against a real server."""

import json
import re
import shutil
import subprocess

import pytest

import motionenv
from motionenv.body import markers
from motionenv.render.cameras import orthographic
from service.reference.samples import SAMPLES, curl
from tests.service.running import run_service


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    with run_service(tmp_path_factory.mktemp("samples")) as server:
        yield server, server.http.get("/openapi.json").json()


def operations(told):
    return {
        operation["operationId"]: (method, path)
        for path, methods in told["paths"].items()
        for method, operation in methods.items()
    }


def test_each_operation_has_a_sample_and_a_verb(running):
    told = operations(running[1])
    assert told.keys() == SAMPLES.keys()
    verbs = {name.partition("_")[0] for name in told}
    known = "analyse cancel check convert describe fit get inspect lift list make remove render report sample"
    assert verbs <= {*known.split(), "synthesize", "upload"}


def points() -> motionenv.Points:
    """A walk as a camera sees it."""
    walk = motionenv.synthesize("walk/fpca", 2.0, 30.0, seed=1)
    seen = 200 * orthographic(markers(walk.poses, walk.skeleton), 0.6) * [1, -1]
    return motionenv.Points(seen, 30.0, "px")


@pytest.mark.slow
def test_python_runs(running, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    server, _ = running
    with motionenv.Client(server.url) as client:
        names = {"client": client, "motionenv": motionenv, "points": points()}
        for name, sample in SAMPLES.items():
            if sample.python and name != "remove_model":
                exec(compile(sample.python, name, "exec"), names)
        assert (tmp_path / "walk.mp4").stat().st_size > 1000
        client.remove_model("fitted/my-walk")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_lines_for_a_shell_run(running, tmp_path):
    server, told = running
    told, job = operations(told), ""
    asked = {"fps": 30, "points": points().positions.tolist()}
    (tmp_path / "points.json").write_text(json.dumps(asked))
    for name in SAMPLES:
        line = curl(name, *told[name], server.url, key=False).replace("/JOB", f"/{job}")
        line = line.replace("curl -s ", "curl -s --fail-with-body --retry 30 --retry-delay 1 ")
        line = line.replace("my-walk", "my-other-walk").replace("copied", "copied-too")
        if name in ("get_result", "get_model_file"):
            line = line.replace("--retry 30", "--retry 60 --retry-all-errors")  # until the job is done
        if name in ("remove_model", "cancel_job"):
            continue  # the model and the job are done with by then, or not yet
        done = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, text=True, timeout=180)
        assert done.returncode == 0, (line, done.stdout[-500:], done.stderr[-500:])
        if name == "render_walk":
            job = re.search(r'"id":"([^"]+)"', done.stdout)[1]
    assert (tmp_path / "walk.mp4").read_bytes()[4:8] == b"ftyp"
    assert (tmp_path / "stimuli.zip").read_bytes()[:2] == b"PK"


def test_a_key_is_part_of_the_line_where_one_is_needed():
    assert "$MOTIONENV_KEY" in curl("list_models", "get", "/v1/models", "http://here", key=True)
