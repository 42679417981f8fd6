"""`GET /v1/models`."""

import time

import numpy as np
import pytest

import motionenv


@pytest.mark.parametrize("name", ["walk/fpca", "walk/eigenwalkers", "walk/prior"])
def test_a_model_is_described_as_it_is(server, name):
    told = server.http.get(f"/v1/models/{name}").json()
    model = motionenv.load(name)
    assert (told["name"], told["kind"], told["ready"], told["synthesis"]) == (name, model.kind, True, True)
    assert told["card"]["people"] == model.card_["people"]
    assert told["licence"] == "MIT"
    variance = getattr(model, "fpca_", model).explained_variance_
    np.testing.assert_allclose([c["deviation"] ** 2 for c in told["components"]], variance)
    assert 0.5 < sum(c["share"] for c in told["components"]) < 1 + 1e-9
    assert told["dimensions"]["components"] == len(variance)
    assert told["ranges"]["speed"] == {"minimum": 0.1, "maximum": 3.0, "unit": "m/s"}


def test_all_models_are_listed(server):
    listed = {model["name"]: model for model in server.http.get("/v1/models").json()["models"]}
    assert {"walk/fpca", "walk/eigenwalkers", "walk/prior", "mixed/tree"} <= set(listed)
    assert listed["walk/fpca"]["ready"]


def test_a_tree_is_described_before_it_is_there_too(server):
    told = server.http.get("/v1/models/mixed/tree").json()
    assert told["card"]["model"] == "mixed/tree"
    assert told["components"] == []
    assert (told["kind"] == "tree") == told["ready"] == bool(told["activities"])


def test_what_a_tree_is_told_to_know_it_grows(server):
    while not (told := server.http.get("/v1/models/mixed/tree").json())["ready"]:
        time.sleep(0.5)
    assert told["activities"] == sorted(set(motionenv.load("mixed/tree").database_.activities))
    for activity in told["activities"]:
        asked = {"start": activity, "activity": activity, "seconds": 0.2, "seed": 1}
        assert server.http.post("/v1/tree/synthesis", json=asked).status_code == 200


@pytest.mark.parametrize("path", ["/v1/models", "/v1/models/walk/fpca"])
def test_descriptions_are_kept(server, path):
    first = server.http.get(path)
    assert first.headers["cache-control"] == "private, no-cache"
    again = server.http.get(path, headers={"If-None-Match": first.headers["etag"]})
    assert again.status_code in (200, 304)  # the tree may have come in between
    assert server.http.get(path, headers={"If-None-Match": '"another"'}).status_code == 200


@pytest.mark.parametrize("path", ["/v1/models/no/such", "/v1/models/fitted/none"])
def test_what_there_is_not_is_404(server, path):
    answer = server.http.get(path)
    assert answer.status_code == 404
    assert "GET /v1/models" in answer.json()["detail"]


@pytest.mark.parametrize("path", ["/v1/models/..%2F..%2Fetc/x", "/v1/models/fitted/%2E%2E"])
def test_odd_names_are_refused(server, path):
    assert server.http.get(path).status_code in (404, 422)


def test_the_order_of_poses_and_markers_is_served(server):
    told = server.http.get("/v1/body").json()
    assert [entry["name"] for entry in told["pose"]] == list(motionenv.types.POSE)
    assert [entry["unit"] for entry in told["pose"]] == ["m"] * 3 + ["rad"] * 22
    assert told["markers"] == list(motionenv.types.MARKERS)
    ends = [{told["markers"][i] for i in edge} for edge in told["edges"]]
    assert {"left_knee", "left_ankle"} in ends
    tag = server.http.get("/v1/body").headers["etag"]
    assert server.http.get("/v1/body", headers={"If-None-Match": tag}).status_code == 304
