"""Bounds of requests to a tree agree with what a tree takes."""

import numpy as np
import pytest
from pydantic import ValidationError

import motionenv
from motionenv import MotionError
from motionenv.models import Target
from motionenv.models.motion_tree import Clip, MotionTree, build_database
from service.schemas.tree import SamplesRequest, SamplesResponse, TreeSynthesisRequest


@pytest.fixture(scope="module")
def tree() -> MotionTree:
    """A tree of three short walks."""
    walks = [motionenv.synthesize("walk/fpca", 4, 30, seed=i, height=1.75) for i in range(3)]
    return MotionTree().fit_database(build_database([Clip(w, f"w{i}", "walk", str(i)) for i, w in enumerate(walks)]))


@pytest.fixture(scope="module")
def poses() -> np.ndarray:
    return motionenv.synthesize("walk/fpca", 5, 30, seed=9).poses


@pytest.mark.parametrize("frames", [10, 120])
@pytest.mark.parametrize("extreme", [{"temperature": 1e-3}, {"temperature": 100.0}, {"noise": 100.0}, {"carry": True}])
def test_samples_at_the_bounds_are_drawn(tree, poses, frames, extreme):
    asked = SamplesRequest(history=poses[:frames].tolist(), n=3, seed=1, **extreme)
    drawn = tree.sample(
        np.array(asked.history), asked.n, seed=asked.seed, temperature=asked.temperature, method=asked.method,
        carry=asked.carry, noise=asked.noise, probability=True,
    )  # fmt: skip
    assert drawn.poses.shape == (3, 25)
    told = SamplesResponse(
        model=asked.model, seed=1, pose=list(motionenv.types.POSE), poses=drawn.poses.tolist(),
        windows=drawn.windows.tolist(), leaves=tree.leaf(drawn.windows).tolist(),
        probabilities=np.exp(drawn.log_probability).tolist(), clip=tree.source(drawn.windows).tolist(), clips={},
    )  # fmt: skip
    np.testing.assert_array_equal(told.poses, drawn.poses)


@pytest.mark.parametrize(
    ("asked", "field", "how"),
    [
        ({"temperature": 0.0}, "temperature", {"temperature": 0.0}),
        ({"noise": -0.1}, "noise", {"noise": -0.1}),
        ({"n": 0}, "n", {"n": 0}),
        ({"method": "best"}, "method", {"method": "best"}),
    ],
)
def test_what_a_tree_refuses_is_refused_before_it_is_asked(tree, poses, asked, field, how):
    with pytest.raises(ValidationError) as refused:
        SamplesRequest(**asked)
    assert refused.value.errors()[0]["loc"] == (field,)
    with pytest.raises(MotionError, match=field):
        tree.sample(poses[:12], how.pop("n", 1), seed=0, **how)


def test_a_history_that_is_too_short_is_refused_by_both(tree, poses):
    with pytest.raises(ValidationError, match="at least 10 items"):
        SamplesRequest(history=poses[:9].tolist())
    with pytest.raises(MotionError, match="10"):
        tree.sample(poses[:9], 1, seed=0)


def test_one_beginning_is_enough(poses):
    with pytest.raises(ValidationError, match="give history or start, not both"):
        SamplesRequest(history=poses[:12].tolist(), start="walk")


@pytest.mark.parametrize("extreme", [{"heading": -3600.0, "speed": 0.0}, {"heading": 3600.0, "speed": 10.0}])
def test_motion_at_the_bounds_grows(tree, extreme):
    asked = TreeSynthesisRequest(seconds=1 / 30, seed=2, activity="walk", **extreme)
    assert asked.frames == 1
    target = Target(asked.activity, np.radians(asked.heading), asked.speed)
    grown = tree.generator(None, seed=asked.seed, method=asked.method, target=target).motion(asked.seconds)
    assert (grown.poses.shape, grown.fps) == ((asked.frames, 25), asked.fps)
    for seconds in (0.51, 1.0, 3600.0):
        assert TreeSynthesisRequest(seconds=seconds).frames == round(30 * seconds)
    with pytest.raises(ValidationError) as refused:
        TreeSynthesisRequest(speed=-0.1)
    assert refused.value.errors()[0]["loc"] == ("speed",)
    with pytest.raises(MotionError, match="speed must be a number of m/s from 0, got -0.1"):
        Target(speed=-0.1)
