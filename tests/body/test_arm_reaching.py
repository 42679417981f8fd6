"""Reaching arms against the minimum-jerk movement of Flash & Hogan (1985)."""

from itertools import pairwise

import numpy as np
import pytest

from motionenv.body import LIMITS
from motionenv.body.arm_reaching import REACH, RIGHT_ARM, reach
from motionenv.types import POSE


@pytest.fixture(scope="module")
def angles():
    return reach(20_000, 200.0, np.random.default_rng(0))


def movements(angles) -> list[np.ndarray]:
    """The whole movements (frames, 4), without the rests between them."""
    moving = np.abs(np.diff(angles, axis=0)).max(axis=1) > 1e-9
    edges = np.flatnonzero(np.diff(moving.astype(int))) + 1
    return [angles[a : b + 1] for a, b in pairwise(edges) if moving[a] and b - a < 262]


def test_it_is_the_right_arm_that_reaches_within_its_limits(angles):
    assert all(POSE[i].startswith("right_") for i in RIGHT_ARM)
    assert angles.shape == (20_000, len(RIGHT_ARM))
    assert (REACH[:, 0] > LIMITS[list(RIGHT_ARM), 0]).all()
    assert (REACH[:, 1] < LIMITS[list(RIGHT_ARM), 1]).all()
    assert ((angles >= REACH[:, 0]) & (angles <= REACH[:, 1])).all()
    covered = np.ptp(angles, axis=0) / np.ptp(REACH, axis=1)
    assert (covered > 0.9).all()


def test_movements_are_straight_and_of_least_jerk(angles):
    """All joints move in proportion; the greatest speed, midway, is 15/8 of the mean."""
    found = movements(angles)
    assert len(found) > 50
    for way in found:
        seconds = (len(way) - 1) / 200
        assert 0.45 < seconds < 1.32
        share = (way - way[0]) / (way[-1] - way[0])
        np.testing.assert_allclose(share, share[:, :1] * np.ones(4), atol=1e-6)
        speed = np.diff(share[:, 0]) * 200 * seconds
        assert speed.max() == pytest.approx(15 / 8, rel=0.03)
        assert abs(speed.argmax() / len(speed) - 0.5) < 0.05


def test_it_never_jumps_whatever_the_rate_and_the_seed_says_all():
    for fps in (10.0, 120.0):
        way = reach(int(30 * fps), fps, np.random.default_rng(3))
        # 170° within half a second, at 15/8 of the mean speed
        assert np.abs(np.diff(way, axis=0)).max() * fps < np.radians(170) / 0.5 * 15 / 8
    one, other = (reach(50, 30.0, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(one, other)
