"""Models go from one service to another as files, and jobs on files belong to the key that made them."""

import json

import httpx
import numpy as np
import pytest
from websockets.sync.client import connect

import motionenv
from tests.service.jobs.handing import as_file, ended, uploads
from tests.service.running import run_service

KEYS = {"anna": "anna-anna-anna-anna", "bert": "bert-bert-bert-bert", "root": "root-root-root-root"}
ASK = {"seed": 1, "seconds": 1, "model": "fitted/mine"}


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A service, and a client of each of its keys; root's is an admin key."""
    keys = {"keys": [KEYS["anna"], KEYS["bert"]], "admin_keys": [KEYS["root"]]}
    with run_service(tmp_path_factory.mktemp("shared"), **keys) as server:
        clients = {
            name: httpx.Client(base_url=server.url, headers={"X-API-Key": key}, timeout=60)
            for name, key in KEYS.items()
        }
        yield clients
        for client in clients.values():
            client.close()


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> list[bytes]:
    """The files of two models."""
    folder = tmp_path_factory.mktemp("models")
    for name in ("walk/fpca", "walk/eigenwalkers"):
        motionenv.load(name).save(folder / f"{name[5:]}.npz")
    return [(folder / f"{name}.npz").read_bytes() for name in ("fpca", "eigenwalkers")]


class Talk:
    """What `ended` needs of a server."""

    def __init__(self, http: httpx.Client):
        self.http = http


def added(http: httpx.Client, content: bytes, **fields: str) -> dict:
    answer = http.post("/v1/models/files", files=uploads({"m.npz": content}), data={"name": "mine"} | fields)
    assert answer.status_code == 202, answer.text
    return ended(Talk(http), answer)


@pytest.mark.slow
def test_a_model_is_added_replaced_downloaded_and_removed_by_its_owner(shared, files):
    anna, bert, root = shared["anna"], shared["bert"], shared["root"]
    assert added(anna, files[0])["status"] == "done"
    kind = lambda http: http.get("/v1/models/fitted/mine").json()["kind"]
    assert kind(anna) == kind(root) == "walking"
    whole = anna.get("/v1/models/fitted/mine/file")
    assert whole.content == files[0]
    assert anna.get("/v1/models/fitted/mine/file", headers={"Range": "bytes=9-19"}).content == files[0][9:20]
    tag = {"If-None-Match": whole.headers["etag"]}
    assert anna.get("/v1/models/fitted/mine/file", headers=tag).status_code == 304
    walk = anna.post("/v1/synthesis", json=ASK).json()

    for method, path in (("GET", ""), ("GET", "/file"), ("GET", "/parameters"), ("DELETE", "")):
        assert bert.request(method, f"/v1/models/fitted/mine{path}").status_code == 404
    assert bert.post("/v1/synthesis", json=ASK).status_code == 404
    assert bert.post("/v1/jobs/render", json=ASK).status_code == 404
    assert "fitted/mine" not in bert.get("/v1/models").text
    taken = bert.post("/v1/models/files", files=uploads({"m.npz": files[1]}), data={"name": "mine", "replace": "true"})
    assert (taken.status_code, taken.json()["type"]) == (409, "/docs#conflict")

    again = anna.post("/v1/models/files", files=uploads({"m.npz": files[1]}), data={"name": "mine"})
    assert again.status_code == 409
    assert "set replace" in again.json()["detail"]
    assert added(anna, files[1], replace="true")["status"] == "done"
    assert kind(anna) == "eigenwalkers"
    assert anna.get("/v1/models/fitted/mine/file", headers=tag).content == files[1]
    assert anna.post("/v1/synthesis", json=ASK).json()["poses"] != walk["poses"]
    assert anna.delete("/v1/models/fitted/mine").status_code == 204
    assert anna.get("/v1/models/fitted/mine/file").status_code == 404


def test_what_is_unlisted_is_for_who_knows_its_name_and_goes_with_its_job(shared, files):
    anna, bert = shared["anna"], shared["bert"]
    job = added(anna, files[0], name="secret-x7", listed="false")
    assert job["status"] == "done"
    assert "secret-x7" not in anna.get("/v1/models").text
    assert job["id"] not in anna.get("/v1/jobs").text
    assert anna.get(f"/v1/jobs/{job['id']}").status_code == 200
    assert anna.get("/v1/models/fitted/secret-x7").status_code == 200
    assert bert.get("/v1/models/fitted/secret-x7").status_code == 404
    assert anna.delete(f"/v1/jobs/{job['id']}").status_code == 204
    assert anna.get("/v1/models/fitted/secret-x7").status_code == 404


@pytest.mark.slow
def test_what_is_no_model_is_told_and_leaves_the_old_one(shared, files):
    anna = shared["anna"]
    added(anna, files[0], name="kept")
    walk = as_file(motionenv.synthesize("walk/fpca", 1, 30, seed=1), ".npz")
    for content in (walk, files[0][:-200]):
        told = added(anna, content, name="kept", replace="true")
        assert (told["status"], told["error"]["status"]) == ("failed", 422)
    assert anna.get("/v1/models/fitted/kept/file").content == files[0]


def test_jobs_and_results_are_seen_by_their_key_and_by_admins(shared):
    anna, bert, root = shared["anna"], shared["bert"], shared["root"]
    walk = as_file(motionenv.synthesize("walk/fpca", 1, 30, seed=1), ".npz")
    job = anna.post("/v1/jobs/inspect", files=uploads({"a.npz": walk}))
    told = ended(Talk(anna), job)
    for http, seen in ((anna, True), (root, True), (bert, False)):
        listed = [one["id"] for one in http.get("/v1/jobs").json()["jobs"]]
        assert (told["id"] in listed) == seen
        for path in ("", "/result"):
            assert http.get(f"/v1/jobs/{told['id']}{path}").status_code == (200 if seen else 404)
    assert bert.post(f"/v1/jobs/{told['id']}/cancel").status_code == 404
    assert bert.delete(f"/v1/jobs/{told['id']}").status_code == 404
    assert root.delete(f"/v1/jobs/{told['id']}").status_code == 204


@pytest.mark.slow
def test_a_stream_of_ones_own_model_goes_on_when_it_is_replaced(shared, files):
    anna = shared["anna"]
    added(anna, files[0], name="live")
    url = str(anna.base_url)
    url = f"ws{url.removeprefix('http')}/v1/stream"

    def opened(key: str):
        return connect(url, additional_headers={"Authorization": f"Bearer {key}"})

    asked = json.dumps({"model": "fitted/live", "seed": 1, "fps": 60})
    with opened(KEYS["anna"]) as stream:
        stream.send(asked)
        assert json.loads(stream.recv())["type"] == "settings"
        before = [np.frombuffer(stream.recv(), "<f4") for _ in range(10)]
        added(anna, files[1], name="live", replace="true")
        after = [np.frombuffer(stream.recv(), "<f4") for _ in range(60)]
    steps = [abs(b - a).max() for a, b in zip([*before, *after], [*before, *after][1:], strict=False)]
    assert max(steps) < 0.35
    with opened(KEYS["bert"]) as other:
        other.send(asked)
        assert "no model" in json.loads(other.recv())["detail"]


def test_models_are_downloaded_as_files(shared, files, tmp_path):
    added(shared["bert"], files[0], name="copied")
    back = tmp_path / "back.npz"
    back.write_bytes(shared["bert"].get("/v1/models/fitted/copied/file").content)
    assert back.read_bytes() == files[0]
    assert motionenv.load(back).kind == "walking"
    assert "no model" in shared["bert"].get("/v1/models/fitted/none/file").json()["detail"]


@pytest.mark.slow
def test_an_axis_between_groups_of_people_is_fitted(shared):
    anna, walks = shared["anna"], {}
    for i in range(6):
        speed = 1.0 if i < 3 else 1.6
        walks[f"p{i}_1.npz"] = as_file(motionenv.synthesize("walk/fpca", 5, 60, seed=i, speed=speed), ".npz")
    groups = '{"slow": ["p0", "p1", "p2"], "fast": ["p3", "p4", "p5"]}'
    fields = {"kind": "eigenwalkers", "name": "axis", "groups": groups}
    answer = anna.post("/v1/models", files=uploads(walks), data=fields)
    told = ended(Talk(anna), answer)
    assert told["status"] == "done", told
    (note,) = anna.get(told["result"]).json()["notes"]
    assert "of 3 slow" in note
    assert "of 3 fast" in note
    assert "groups" in anna.post("/v1/models", files=uploads(walks), data=fields | {"kind": "fpca"}).json()["detail"]
    for wrong in ("{", '{"a": ["p0", "p1"]}', '{"a": ["p0"], "b": ["p1", "p2"]}'):
        assert anna.post("/v1/models", files=uploads(walks), data=fields | {"groups": wrong}).status_code == 422
    unknown = fields | {"name": "b", "groups": groups.replace("p5", "p9")}
    failed = ended(Talk(anna), anna.post("/v1/models", files=uploads(walks), data=unknown))
    assert (failed["status"], "no walk of p9" in failed["message"]) == ("failed", True)
