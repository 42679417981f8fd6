"""A client that is generated from the OpenAPI document asks the live service, and gets what the document promises."""

import importlib
import io
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import httpx
import numpy as np
import pytest

import motionenv

ROOT = Path(__file__).parents[3]
CALLS = ("motion.synthesize_walk", "motion.get_walk", "motion.walk_in_place", "motion.make_stimuli", "models.get_model",
         "models.get_parameters", "jobs.convert_capture", "jobs.get_job", "jobs.get_result")  # fmt: skip


@pytest.fixture(scope="module")
def generated(server, tmp_path_factory):
    """The package, generated as docs/service.md says."""
    pytest.importorskip("openapi_python_client", reason="pip install -e '.[dev]'")
    folder = tmp_path_factory.mktemp("client")
    text = (ROOT / "docs" / "service.md").read_text()
    (folder / "client.yaml").write_text(text.partition("```yaml\n")[2].partition("```")[0])
    command = [sys.executable, "-m", "openapi_python_client", "generate", "--url", f"{server.url}/openapi.json",
               "--config", "client.yaml", "--output-path", "made", "--fail-on-warning"]  # fmt: skip
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    sys.path.insert(0, str(folder / "made"))
    yield importlib.import_module("motionenv_client")
    sys.path.remove(str(folder / "made"))


@pytest.fixture
def calls(generated) -> dict[str, ModuleType]:
    """Modules of operations by their names."""
    return {name.split(".")[1]: importlib.import_module(f"motionenv_client.api.{name}") for name in CALLS}


@pytest.fixture
def client(generated, server):
    """The client of the live service."""
    with generated.Client(base_url=server.url, timeout=httpx.Timeout(60)) as running:
        yield running


def test_walks_and_problems_have_their_types(server, generated, client, calls):
    models = importlib.import_module("motionenv_client.models")

    told = calls["synthesize_walk"].sync(client=client, body=models.SynthesisRequest(seed=3, seconds=1.0, speed=1.2))
    assert isinstance(told, models.MotionResponse)
    assert (told.model, told.seed, told.fps) == ("walk/fpca", 3, 30.0)
    np.testing.assert_array_equal(told.poses, motionenv.synthesize("walk/fpca", 1, 30, seed=3, speed=1.2).poses)
    wrong = calls["synthesize_walk"].sync(client=client, body=models.SynthesisRequest(speed=99.0))
    assert isinstance(wrong, models.ProblemDetail)
    assert wrong.errors[0].field == "/speed"
    cycle = calls["walk_in_place"].sync(client=client, body=models.CycleRequest(samples=8))
    assert isinstance(cycle, models.CycleResponse)
    about = calls["get_model"].sync("walk", "fpca", client=client)
    assert isinstance(about, models.ModelDescription)
    assert about.components[0].name == "component 1"


def test_what_is_binary_comes_as_bytes(server, generated, client, calls):
    models = importlib.import_module("motionenv_client.models")

    npz = calls["get_walk"].sync(
        client=client, seed=3, seconds=1.0, deviations="[1.0, -0.5]", format_="application/x-npz"
    )
    wanted = motionenv.synthesize("walk/fpca", 1, 30, seed=3, deviations=[1.0, -0.5])
    np.testing.assert_array_equal(np.load(npz.payload)["poses"], wanted.poses)
    small = models.StimuliRequest(seconds=0.1, width=32, height=32)
    assert calls["make_stimuli"].sync(client=client, body=small).payload.read(2) == b"PK"
    assert len(calls["get_parameters"].sync("walk", "fpca", client=client).payload.read()) > 10_000


def test_a_job_goes_all_the_way(server, generated, client, calls):
    models, types = (importlib.import_module(f"motionenv_client.{name}") for name in ("models", "types"))

    walk = server.http.post("/v1/synthesis", json={"seed": 1}, headers={"Accept": "application/x-c3d"}).content
    files = [types.File(payload=io.BytesIO(walk), file_name="walk.c3d")]
    body = models.ConvertCaptureConvertFields(files=files, format_=models.ConvertCaptureConvertFieldsFormat.TEXTCSV)
    job = calls["convert_capture"].sync(client=client, body=body)
    assert isinstance(job, models.JobStatus)
    deadline = time.monotonic() + 120
    while job.status in ("queued", "running"):
        assert time.monotonic() < deadline
        job = calls["get_job"].sync(job.id, client=client, wait=5)
    assert job.status == "done"
    table = calls["get_result"].sync(job.id, client=client).payload.read()
    assert table == server.http.get(job.result).content
