"""What a walking model learns of people from walks of which that is known."""

import numpy as np
import pytest

import motionenv
from motionenv.models.treadmill_cycle import walk_in_place
from motionenv.models.walking.people import _even


@pytest.fixture(scope="module")
def model():
    return motionenv.load("walk/fpca")


def test_it_knows_how_long_strides_are(model):
    """Log stride lengths within 3 % of those of walking in place, of people who were not drawn to learn it."""
    scores = model.sample(60, seed=11).scores
    lengths = np.log(walk_in_place(model, scores).strides / model.height_)
    assert (model.pace_.log_length(model.standard(scores)) - lengths).std() < 0.03


def test_knees_bend_with_speed_as_in_published_walks(model):
    """About 15° per log stride length at the knee's greatest flexion, where its curve is steep in no direction."""
    z = np.zeros((1, 8))
    longer, shorter = (model.pace_.longer(z, change, model.pace_.direction) for change in (0.1, -0.1))
    peaks = [
        np.degrees(walk_in_place(model, model._scores(each)).frames[0][:, [20, 24]].max(axis=0).mean())
        for each in (longer, shorter)
    ]
    assert (peaks[0] - peaks[1]) / 0.2 == pytest.approx(15, abs=8)


def test_walks_that_start_or_stop_do_not_tell_how_cycles_vary():
    rng = np.random.default_rng(0)
    even = [rng.standard_normal((6, 3)) for _ in range(12)]
    even = [trial - trial.mean(axis=0) for trial in even]
    uneven = 20 * (np.arange(6) - 2.5)[:, None] * np.ones(3)
    np.testing.assert_allclose(_even([*even, uneven]), _even(even))
    np.testing.assert_allclose(_even(even), np.eye(3), atol=0.5)
