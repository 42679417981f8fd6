"""Forecasts against parameters of whole motions, and shares that were put in."""

import numpy as np
import pytest

from motionenv.models.motion_tree.features import local, parameters, turned_towards
from motionenv.models.motion_tree.forecast import Forecast, following, steps


@pytest.fixture(scope="module")
def frames(database):
    return np.random.default_rng(0).choice(database.windows, (6, 7))


def test_steps_are_the_parameters_of_the_motion_itself(database, frames):
    now, after = steps(database, frames)
    assert (now.shape, after.shape) == ((6, 7, 50), (6, 7, 25))
    for at in np.ndindex(frames.shape):
        sequence = database.sequence_of(frames[at])
        first = database.starts[sequence]
        whole = parameters(database.motion(sequence).poses)
        np.testing.assert_allclose(now[at], whole[frames[at] - first], atol=1e-5)
        np.testing.assert_allclose(
            after[at], local(database.poses[frames[at]], database.poses[frames[at] + 1]), atol=1e-5
        )
    np.testing.assert_array_equal(following(database, frames), after)


def test_who_is_where_the_window_is_goes_on_as_it_did(database, frames, tree):
    now, after = steps(database, frames)
    np.testing.assert_array_equal(tree.forecast_.carried(now, now, after), after)


def test_shares_of_the_difference_are_added_the_shorter_way_round():
    share = np.full(25, 0.5)
    forecast = Forecast(share, np.full(25, 0.1), np.ones(25), np.ones(25))
    now, history, after = np.zeros(50), np.zeros(50), np.zeros(25)
    history[9], history[0], history[25 + 9] = 2 * np.pi - 0.2, 0.3, 6.0
    told = forecast.carried(history, now, after)
    # a share of -0.2 rad, and of 6 rad/s for a thirtieth of a second
    assert told[9] == pytest.approx(0.5 * -0.2 + 0.1 * 6.0 / 30)
    assert told[0] == pytest.approx(0.15)
    assert np.count_nonzero(told) == 2


def test_the_fit_leaves_less_error_than_the_paper_and_predicts_a_stranger(tree, database, stranger):
    """Neighbours in place of the truth: errors of one step that it never saw are as large as it says."""
    forecast = tree.forecast_
    assert (forecast.deviation <= forecast.plain_deviation * (1 + 1e-9)).all()
    assert np.median(forecast.deviation / forecast.plain_deviation) < 0.5
    whole = parameters(stranger.poses)
    histories = np.stack([stranger.poses[t - 12 : t + 1] for t in range(12, 110, 3)])
    drawn = tree.sample(histories, 8, seed=1, temperature=0.05, method="exact").windows
    now, after = steps(database, tree.frames_[drawn])
    error = turned_towards(
        forecast.carried(whole[12:110:3, None], now, after) - whole[13:111:3, None, :25], np.zeros(25)
    )
    ratio = np.sqrt((error**2).mean((0, 1))) / forecast.deviation
    assert 0.5 < np.median(ratio) < 1.5
