"""`POST /v1/cycles`: the stride that Python makes, in every format."""

import io

import numpy as np
import pytest

import motionenv
from motionenv.models import cycle
from service.formats.parameters import MEDIA_TYPE
from tests.service.waiting import until

NUMBERS = {"stride", "seconds", "height", "weight"}
NAMES = {"markers", "poses", "standing", "contacts", "offsets", "radii", "deviations", *NUMBERS}


def post(server, accept="application/json", **asked):
    return server.http.post("/v1/cycles", json=asked, headers={"Accept": accept})


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_it_is_the_stride_that_python_makes(server, model):
    how = {"deviations": [1.5, -0.5], "speed": 1.2, "height": 1.6, "samples": 48}
    want, told = cycle(model, **how), post(server, model=model, **how).json()
    for name in ("markers", "poses", "standing", "contacts"):
        np.testing.assert_array_equal(told[name], getattr(want, name))
    np.testing.assert_array_equal(told["offsets"], want.body.offsets)
    assert (told["model"], told["stride"], told["seconds"], told["height"]) == (model, want.stride, want.seconds, 1.6)
    assert told["stride"] / told["seconds"] == pytest.approx(1.2)


def test_every_format_has_the_same_numbers(server):
    asked = {"scores": [0.3], "speed": 1.4}
    want, whole = cycle("walk/fpca", **asked), post(server, **asked).json()
    with np.load(io.BytesIO(post(server, "application/x-npz", **asked).content)) as arrays:
        assert set(arrays) == NAMES
        for name in NAMES:
            np.testing.assert_array_equal(arrays[name], whole[name])
    poses = np.load(io.BytesIO(post(server, "application/x-npy", **asked).content))
    np.testing.assert_array_equal(poses, want.poses)
    packed = post(server, MEDIA_TYPE, **asked)
    assert packed.content.endswith(want.body.radii.astype("<f8").tobytes())


def test_a_seed_draws_the_walker_and_without_any_it_is_the_average(server):
    model = motionenv.load("walk/fpca")
    drawn = cycle(model, walker=model.walker(7))
    np.testing.assert_array_equal(post(server, seed=7).json()["poses"], drawn.poses)
    np.testing.assert_array_equal(post(server).json()["poses"], cycle(model).poses)
    assert post(server).json()["deviations"] == [0] * 8
    np.testing.assert_allclose(post(server, deviations=[1.5]).json()["deviations"], [1.5, *[0] * 7], atol=1e-12)


def test_the_weight_is_that_of_the_body(server):
    """Asked for, the weight that was told makes the same body; without it, another height keeps the build."""
    drawn = post(server, seed=7, person="woman").json()
    again = post(server, seed=7, person="woman", weight=drawn["weight"]).json()
    np.testing.assert_allclose(again["radii"], drawn["radii"], rtol=1e-9)
    assert again["weight"] == drawn["weight"]
    taller = post(server, seed=7, person="woman", height=drawn["height"] + 0.1).json()
    assert taller["weight"] / taller["height"] ** 2 == pytest.approx(drawn["weight"] / drawn["height"] ** 2)
    weights = [post(server, seed=seed, person="man").json()["weight"] for seed in range(8)]
    assert 60 < np.mean(weights) < 110
    assert np.std(weights) > 5


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers", "walk/prior"])
@pytest.mark.parametrize("how", [{}, {"speed": 1.6}, {"height": 1.5}, {"person": "child"}, {"weight": 95.0}])
def test_a_seed_draws_who_walks_over_the_ground(server, model, how):
    told = post(server, model=model, seed=5, **how).json()
    walk = motionenv.synthesize(model, 8, 60, seed=5, variation=0.0, **how)
    assert told["height"] == pytest.approx(walk.skeleton.height, rel=1e-9)
    np.testing.assert_allclose(told["radii"], walk.skeleton.radii, rtol=1e-9)
    speed = (walk.poses[-1, 0] - walk.poses[0, 0]) * 60 / 479
    assert told["stride"] / told["seconds"] == pytest.approx(speed, rel=0.04)  # 8 s aren't whole strides
    again = post(server, model=model, deviations=told["deviations"], speed=speed, height=told["height"]).json()
    knees = np.array([(np.array(one["poses"])[:, [20, 24]]) for one in (told, again)])
    assert np.abs(knees[0] - knees[1]).max() < np.radians(12)  # the same style


def test_the_same_stride_is_not_sent_again(server):
    first = post(server, seed=7)
    again = server.http.post("/v1/cycles", json={"seed": 7}, headers={"If-None-Match": first.headers["ETag"]})
    assert (again.status_code, again.json()["type"]) == (412, "/docs#precondition-failed")
    assert "Motion-Warning" not in first.headers
    assert "beyond" in post(server, speed=2.9).headers["Motion-Warning"]


@pytest.mark.parametrize(
    ("asked", "field", "says"),
    [
        ({"seed": 1, "scores": [1.0]}, "/seed", "one of seed, deviations and scores"),
        ({"speed": 9}, "/speed", "3"),
        ({"samples": 7}, "/samples", "8"),
        ({"model": "mixed/tree"}, "/model", "no cycles in place"),
    ],
)
def test_what_can_not_be_is_named(server, asked, field, says):
    until(lambda: post(server, **asked).status_code != 503)  # the tree is being made
    refused = post(server, **asked)
    assert refused.status_code == 422
    error = refused.json()["errors"][0]
    assert error["field"] == field
    assert says in error["problem"]
