"""Starts are drawn as they say, and resampling gives each its share, rounded."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv.errors import MotionError
from motionenv.tracking.priors.base import SPREAD, Start, systematic

POSES = np.random.default_rng(0).normal(size=(3, 25))


def start(**changes) -> Start:
    return Start(**{"poses": POSES, "log_weights": np.zeros(3), "previous": POSES - 0.1, "spread": SPREAD} | changes)


@given(st.lists(st.floats(0, 10), min_size=1, max_size=12).filter(lambda w: sum(w) > 1e-3), st.integers(1, 200))
def test_each_comes_as_often_as_its_weight_says_rounded_up_or_down(weights, n):
    counts = np.bincount(systematic(np.array(weights), n, np.random.default_rng(1)), minlength=len(weights))
    expected = n * np.array(weights) / np.sum(weights)
    assert counts.sum() == n
    assert (np.abs(counts - expected) < 1 + 1e-9).all()


def test_on_average_it_is_exactly_the_weight():
    rng, weights = np.random.default_rng(2), np.array([0.05, 0.0, 0.35, 0.6])
    counts = sum(np.bincount(systematic(weights, 3, rng), minlength=4) for _ in range(4000)) / 4000
    np.testing.assert_allclose(counts, 3 * weights, atol=0.03)


def test_candidates_come_by_weight_with_noise_that_keeps_their_velocity():
    given = start(log_weights=np.log([1.0, 2.0, 5.0]) - 800)
    which, poses, previous = given.draw(8000, np.random.default_rng(3))
    np.testing.assert_array_equal(np.bincount(which), [1000, 2000, 5000])
    for i in range(3):
        off = poses[which == i] - POSES[i]
        np.testing.assert_allclose(off.mean(0), 0, atol=5 * SPREAD.max() / np.sqrt(1000))
        np.testing.assert_allclose(off.std(0), SPREAD, rtol=0.12)
    np.testing.assert_allclose(poses - previous, 0.1, atol=1e-12)


def test_at_one_pose_all_but_the_spread_is_known():
    known = Start.at(POSES[0], POSES[1], spread=0.0)
    _, poses, previous = known.draw(5, np.random.default_rng(4))
    np.testing.assert_array_equal(poses, np.tile(POSES[0], (5, 1)))
    np.testing.assert_array_equal(previous, np.tile(POSES[1], (5, 1)))
    assert np.isnan(Start.at(POSES[0]).draw(5, np.random.default_rng(4))[2]).all()
    np.testing.assert_array_equal(Start.at(POSES[0]).spread, SPREAD)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"poses": np.zeros((3, 24))}, r"Start\.poses must have shape"),
        (
            {"poses": np.zeros((0, 25)), "log_weights": [], "previous": np.zeros((0, 25))},
            r"Start\.poses must be finite",
        ),
        ({"poses": np.where(np.arange(25) == 3, np.nan, POSES)}, r"Start\.poses must be finite"),
        ({"log_weights": np.full(3, -np.inf)}, r"at least one of Start\.log_weights"),
        ({"log_weights": [0.0, np.nan, 0.0]}, r"Start\.log_weights"),
        ({"log_weights": np.zeros(2)}, r"Start\.log_weights must have shape \(3,?\), got \(2,\)"),
        ({"previous": POSES * np.inf}, r"Start\.previous finite or NaN"),
        ({"spread": np.full(25, -0.1)}, r"Start\.spread must be finite and at least 0"),
        ({"spread": np.full(25, np.inf)}, r"Start\.spread must be finite"),
    ],
)
def test_a_start_that_can_not_be_is_named(changes, says):
    with pytest.raises(MotionError, match=says):
        start(**changes)


def test_a_pose_of_gaps_is_no_start():
    with pytest.raises(MotionError, match=r"Start\.poses must be finite"):
        Start.at(np.full(25, np.nan))
    with pytest.raises(MotionError, match=r"previous must have shape \(25,?\), got \(24,\)"):
        Start.at(np.zeros(25), np.zeros(24))
