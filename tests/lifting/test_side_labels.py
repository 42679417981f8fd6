"""Swapped sides: found in rays where they were made, and nowhere else, and put back."""

import numpy as np
import pytest

from motionenv.lifting.side_labels import exchanged, find_swaps
from motionenv.types import MARKERS

RNG = np.random.default_rng(0)
PLACES = np.array([4.0, 0, 0]) + np.stack([np.zeros(15), RNG.uniform(-0.5, 0.5, 15), RNG.uniform(-1, 1, 15)], -1)
PLACES = np.repeat(PLACES[None], 60, axis=0)


def rays(noise: float) -> np.ndarray:
    way = PLACES + noise * RNG.standard_normal(PLACES.shape)
    return way / np.linalg.norm(way, axis=-1, keepdims=True)


@pytest.mark.parametrize(("arms", "legs"), [((10, 11), (30, 50)), ((0, 5), (59, 60)), ((20, 20), (0, 60))])
def test_spans_of_exchanged_labels_are_found(arms, legs):
    labels = np.zeros((60, 2), dtype=bool)
    labels[slice(*arms), 0] = labels[slice(*legs), 1] = True
    found = find_swaps(exchanged(rays(0.02), labels), PLACES, 0.02)
    assert (found == labels).all()


def test_gaps_and_noise_are_no_exchange():
    seen = rays(0.05)
    seen[RNG.uniform(size=seen.shape[:2]) < 0.3] = np.nan
    assert not find_swaps(seen, PLACES, 0.05).any()


def test_exchanging_twice_changes_nothing():
    labels = RNG.uniform(size=(60, 2)) < 0.5
    once = exchanged(PLACES, labels)
    knees = [MARKERS.index("left_knee"), MARKERS.index("right_knee")]
    np.testing.assert_array_equal(once[labels[:, 1]][:, knees], PLACES[labels[:, 1]][:, knees[::-1]])
    np.testing.assert_array_equal(exchanged(once, labels), PLACES)
