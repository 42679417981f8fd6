"""Traits: a step along one makes more of what it is called after, whoever takes it."""

import numpy as np
import pytest

import motionenv
from motionenv import MotionError
from motionenv.models.traits import FEATURES
from motionenv.models.traits import measured as measured_of

MODELS = ["walk/fpca", "walk/eigenwalkers"]


def traits(model):
    return model.traits()


def measured(model, deviations):
    return measured_of(model.components(), model.treadmill(), deviations)


@pytest.fixture(scope="module", params=MODELS)
def model(request):
    return motionenv.load(request.param)


def test_directions_are_steps_of_one_deviation(model):
    for trait in traits(model):
        assert np.linalg.norm(trait.direction) == pytest.approx(1)
        assert trait.gain > 0
        assert 0.5 < trait.share <= 1
        assert trait.low != trait.high


def test_a_step_makes_more_of_it(model):
    """From the average and from each of some drawn people: monotone over four steps, about as much as is told."""
    people = np.concatenate([np.zeros((1, q := len(traits(model)[0].direction))),
                             np.random.default_rng(1).normal(0, 0.7, (6, q))])  # fmt: skip
    for trait in traits(model):
        column = list(FEATURES).index(trait.name)
        steps = np.stack([measured(model, people + t * trait.direction)[:, column] for t in (-1, 0, 1, 2)])
        gains = np.diff(steps, axis=0)
        assert (gains[:, 0] > 0).all(), trait.name
        assert (gains > 0).mean() > 0.9, trait.name
        assert gains.mean() == pytest.approx(trait.gain, rel=0.45), trait.name


def test_no_direction_changes_it_more(model):
    """Of random directions of the same length, none has a clearly steeper slope over people."""
    rng = np.random.default_rng(2)
    for trait in traits(model):
        column = list(FEATURES).index(trait.name)
        people = rng.normal(0, 0.5, (40, len(trait.direction)))
        slope = lambda d, c=column, z=people: np.diff([measured(model, z + t * d)[:, c].mean() for t in (-0.5, 0.5)])[0]
        others = rng.normal(size=(5, len(trait.direction)))
        others /= np.linalg.norm(others, axis=1, keepdims=True)
        assert max(abs(slope(d)) for d in others) < 1.05 * slope(trait.direction), trait.name


def test_they_are_the_same_every_time(model):
    for one, other in zip(traits(model), traits(model), strict=True):
        np.testing.assert_array_equal(one.direction, other.direction)


def test_one_body_says_nothing_about_height():
    assert "height" not in [trait.name for trait in traits(motionenv.load("walk/fpca"))]


def test_what_has_no_components_has_no_traits():
    tree = motionenv.load("mixed/tree")
    assert tree.traits() == []
    with pytest.raises(MotionError, match="shape"):
        measured(motionenv.load("walk/fpca"), np.zeros((2, 3)))
