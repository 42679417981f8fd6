"""The gait of synthesized walks is what the library's own analysis of them is."""

import json

import pytest

import motionenv
from motionenv.gait import Session, analyse, shipped_band
from motionenv.gait.report import to_json

ASK = {"model": "walk/fpca", "seed": 3, "speed": 1.4, "height": 1.8, "deviations": [1.0, -0.5]}


def test_it_is_the_librarys_report(server):
    answer = server.http.post("/v1/gait", json=ASK)
    walk = motionenv.synthesize(
        "walk/fpca",
        8,
        100,
        seed=3,
        speed=1.4,
        height=1.8,
        walker=motionenv.load("walk/fpca").walker(deviations=[1, -0.5]),
    )
    own = json.loads(to_json(Session((analyse(walk),), {}, shipped_band())))
    told = answer.json()
    assert told == own
    found = {(one["name"], one["side"]): one["mean"] for one in told["parameters"]}
    assert found["speed", ""] == pytest.approx(1.4, abs=0.05)
    assert 90 < found["cadence", ""] < 140
    assert (
        len(told["band"]["angles"]["knee_flexion"]["mean"]) == len(told["angles"]["left_knee_flexion"]["mean"]) == 101
    )
    assert server.http.post("/v1/gait", json=ASK, headers={"If-None-Match": answer.headers["etag"]}).status_code == 412


@pytest.mark.parametrize("model", ["walk/eigenwalkers", "walk/prior"])
def test_every_walking_model_has_a_gait(server, model):
    told = server.http.post("/v1/gait", json={"model": model, "seed": 1}).json()
    stance = {one["side"]: one["mean"] for one in told["parameters"] if one["name"] == "stance"}
    # People stand for about 60 %; two harmonics of an ankle's path don't tell when the foot is put down.
    assert 45 < stance["left"] < 72
    assert 45 < stance["right"] < 72


def test_a_walk_without_strides_is_told(server):
    answer = server.http.post("/v1/gait", json={"seed": 1, "seconds": 2, "speed": 0.1})
    assert answer.status_code == 422
    assert "no stride of even speed" in answer.json()["detail"]
    short = server.http.post("/v1/gait", json={"seconds": 1}).json()
    assert short["errors"][0]["bound"] == {"ge": 2.0}
