"""`POST /v1/tree/samples` against the tree itself."""

import time

import numpy as np
import pytest

import motionenv
from motionenv.models import Target


@pytest.fixture(scope="module")
def tree():
    return motionenv.load("mixed/tree")


@pytest.fixture(scope="module")
def asking(server, tree):
    """A function that asks for samples, once the server has its tree."""
    for _ in range(600):
        if server.http.post("/v1/tree/samples", json={"seed": 1}).status_code != 503:
            break
        time.sleep(0.5)
    return lambda **asked: server.http.post("/v1/tree/samples", json=asked)


@pytest.fixture(scope="module")
def walk():
    return motionenv.synthesize("walk/fpca", 1.0, 30, seed=3).poses


@pytest.mark.parametrize("method", ["tree", "exact"])
def test_samples_are_those_of_the_tree(asking, tree, walk, method):
    told = asking(history=walk.tolist(), n=50, seed=7, temperature=0.2, method=method, carry=True).json()
    drawn = tree.sample(walk, 50, seed=7, temperature=0.2, method=method, carry=True)
    assert told["poses"] == drawn.poses.tolist()
    assert told["windows"] == drawn.windows.tolist()
    np.testing.assert_allclose(told["probabilities"], np.exp(drawn.log_probability), rtol=1e-12)
    clips = [tree.database_.clips[i] for i in tree.source(drawn.windows)]
    assert [told["clips"][str(i)] for i in told["clip"]] == clips


def test_leaves_hold_their_windows(asking, tree, walk):
    told = asking(history=walk.tolist(), n=20, seed=1).json()
    for window, leaf in zip(told["windows"], told["leaves"], strict=True):
        assert window in tree.descent_.members[tree.descent_.starts[leaf] : tree.descent_.starts[leaf + 1]]


def test_a_named_start_is_a_history_of_that_activity(asking, tree):
    activity = tree.database_.activities[0]
    told = asking(start=activity, n=5, seed=2)
    assert told.status_code == 200
    assert told.content == asking(start=activity, n=5, seed=2).content
    assert asking(start="flying", n=1).status_code == 422


def test_many_samples_come_too(asking, walk):
    assert len(asking(history=walk.tolist(), n=10_000, seed=1).json()["poses"]) == 10_000


@pytest.mark.parametrize(
    ("asked", "field"),
    [
        ({"n": 10_001}, "/n"),
        ({"n": 0}, "/n"),
        ({"temperature": 0}, "/temperature"),
        ({"history": [[0.0] * 25] * 9}, "/history"),
        ({"history": [[0.0] * 24] * 10}, "/history/0"),
        ({"model": "walk/fpca"}, "/model"),
    ],
)
def test_what_is_wrong_is_told(asking, asked, field):
    answer = asking(**asked)
    assert answer.status_code == 422
    assert field in [error["field"] for error in answer.json()["errors"]]


def test_a_history_and_a_start_are_one_too_many(asking, walk):
    assert asking(history=walk.tolist(), start="walk").status_code == 422


def test_motion_that_grows_is_that_of_python(server, asking, tree, walk):
    asked = {"history": walk.tolist(), "seconds": 2.0, "seed": 5, "temperature": 0.1, "heading": 45.0}
    told = server.http.post("/v1/tree/synthesis", json=asked)
    target = Target(heading=np.radians(45.0))
    grown = tree.generator(walk, temperature=0.1, seed=5, target=target).motion(2.0)
    assert told.json()["poses"] == grown.poses.tolist()
    again = server.http.post("/v1/tree/synthesis", json=asked, headers={"If-None-Match": told.headers["etag"]})
    assert again.status_code == 412
    bvh = server.http.post("/v1/tree/synthesis", json=asked, headers={"Accept": "model/x-bvh"})
    assert bvh.text.startswith("HIERARCHY")
