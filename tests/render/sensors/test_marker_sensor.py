"""Markers as a tracker gives them, against the cameras, and the noise and gaps against what they promise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import MotionError
from motionenv.render.cameras import orthographic, view
from motionenv.render.sensors.marker_sensor import EYE_HEIGHT, MarkerSensor

CLEAR = {"noise": 0.0, "dropout": 0.0, "gaps": 0.0, "gap_seconds": 0.3, "distance": None, "fps": 30.0}


def bodies(n, seed=0):
    return np.random.default_rng(seed).uniform([-0.6, -0.6, 0], [0.6, 0.6, 1.8], (n, 15, 3))


def watched(sensor, walkers, alphas, frames=1, keys=None):
    """Points (frames, n, 15, 2), whether seen (frames, n, 15), and joints (n, 15, 3) at the end."""
    n = len(walkers)
    made = sensor.view(n)
    keys = np.arange(n, dtype=np.uint64) if keys is None else keys
    points, seen = [], []
    for t in range(frames):
        made.look(np.arange(n), walkers, alphas, keys, np.full(n, t))
        points.append(made.points.copy())
        seen.append(made.seen.copy())
    return np.array(points), np.array(seen), made.joints


@given(st.lists(st.floats(-7, 7), min_size=1, max_size=5), st.integers(0, 999))
@settings(max_examples=30, deadline=None)
def test_without_noise_it_is_paper_bs_projection(alphas, seed):
    walkers = bodies(len(alphas), seed)
    points, seen, joints = watched(MarkerSensor(**CLEAR), walkers, np.array(alphas))
    expected = orthographic(walkers, np.array(alphas)[:, None])
    np.testing.assert_allclose(points[0], expected, atol=1e-6)
    np.testing.assert_allclose(joints[..., [0, 2]], expected, atol=1e-9)
    assert seen.all()


@given(st.floats(-7, 7), st.floats(2, 20), st.integers(0, 999))
@settings(max_examples=30, deadline=None)
def test_from_a_distance_it_is_the_cameras(alpha, distance, seed):
    """Pixels of `view` at that angle, in metres at the walker's distance; and joints as that camera has them."""
    walkers = bodies(1, seed)
    points, _, joints = watched(MarkerSensor(**CLEAR | {"distance": distance}), walkers, np.array([alpha]))
    camera = view(alpha, distance=distance, eye_height=EYE_HEIGHT, target=(0, 0, EYE_HEIGHT))
    pixels, depth = camera.project(walkers)
    metres = (pixels - camera.K[:2, 2]) * distance / camera.K[0, 0] * [1, -1] + [0, EYE_HEIGHT]
    np.testing.assert_allclose(points[0], metres, atol=1e-5)
    np.testing.assert_allclose(joints[..., 1], depth - distance, atol=1e-9)
    still = view(0, distance=distance, eye_height=EYE_HEIGHT, target=(0, 0, EYE_HEIGHT))
    np.testing.assert_allclose(still.project(joints)[0], pixels, atol=1e-6)


def test_noise_is_gaussian_of_the_deviation_asked_for():
    walkers, alphas = bodies(40), np.zeros(40)
    points, _, _ = watched(MarkerSensor(**CLEAR | {"noise": 0.02}), walkers, alphas, frames=50)
    rest = ((points - orthographic(walkers, 0.0)) / 0.02).reshape(-1, 2)
    n = rest.size
    assert abs(rest.mean()) < 5 / np.sqrt(n)
    assert abs(rest.std() - 1) < 5 / np.sqrt(2 * n)
    assert abs(np.corrcoef(rest.T)[0, 1]) < 5 / np.sqrt(len(rest))
    assert abs((rest**4).mean() - 3) < 5 * np.sqrt(96 / n)


@pytest.mark.parametrize(("dropout", "gaps"), [(0.2, 0.0), (0.0, 0.3), (0.1, 0.2), (1.0, 0.0)])
def test_as_much_is_missing_as_asked_for_in_every_frame(dropout, gaps):
    sensor = MarkerSensor(**CLEAR | {"dropout": dropout, "gaps": gaps})
    _, seen, _ = watched(sensor, bodies(300), np.zeros(300), frames=60)
    expected = (1 - dropout) * (1 - gaps)
    assert seen.mean() == pytest.approx(expected, abs=0.01)
    np.testing.assert_allclose(seen.mean(axis=(1, 2)), expected, atol=0.05)


def test_gaps_last_as_long_as_asked_for():
    sensor = MarkerSensor(**CLEAR | {"gaps": 0.2, "gap_seconds": 0.4, "fps": 25.0})
    _, seen, _ = watched(sensor, bodies(100), np.zeros(100), frames=400)
    missing = np.concatenate([np.zeros((1, 1500), int), 1 - seen.reshape(400, -1), np.zeros((1, 1500), int)])
    edges = np.diff(missing, axis=0)
    lasting = np.concatenate([np.flatnonzero(e == -1) - np.flatnonzero(e == 1) for e in edges.T])
    whole = np.concatenate([[0], lasting])[1:]
    assert whole.mean() == pytest.approx(0.4 * 25, rel=0.05)
    assert whole.std() == pytest.approx(np.sqrt(0.9) * 10, rel=0.1)  # geometric


def test_what_is_not_seen_is_zero_and_nothing_is_nan():
    sensor = MarkerSensor(**CLEAR | {"noise": 0.05, "dropout": 0.3, "gaps": 0.3})
    points, seen, _ = watched(sensor, bodies(50), np.zeros(50), frames=30)
    assert (points[seen == 0] == 0).all()
    assert (points[seen == 1] != 0).all()
    assert np.isfinite(points).all()
    assert set(np.unique(seen)) == {0, 1}


def test_what_is_seen_depends_on_the_key_and_frame_alone():
    sensor = MarkerSensor(**CLEAR | {"noise": 0.05, "dropout": 0.3, "gaps": 0.3})
    walkers, alphas, keys = bodies(9), np.linspace(0, 3, 9), np.arange(9, dtype=np.uint64) * 7 + 2**60
    together = watched(sensor, walkers, alphas, 20, keys)
    alone = watched(sensor, walkers[4:5], alphas[4:5], 20, keys[4:5])
    np.testing.assert_array_equal(together[0][:, 4], alone[0][:, 0])
    np.testing.assert_array_equal(together[1][:, 4], alone[1][:, 0])
    assert not np.array_equal(together[1][:, 4], together[1][:, 5])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"noise": -0.1}, "noise must be a number of metres from 0 to 1"),
        ({"noise": np.nan}, "noise"),
        ({"noise": "much"}, "noise"),
        ({"dropout": 1.5}, "dropout must be a number from 0 to 1"),
        ({"gaps": 0.95}, "gaps must be a number from 0 to 0.9"),
        ({"gap_seconds": 0}, "gap_seconds"),
        ({"distance": 1.0}, "distance must be a number of metres from 2"),
        ({"gaps": 0.8, "gap_seconds": 0.04}, "increase gap_seconds"),
    ],
)
def test_impossible_sensors_are_refused(wrong, message):
    with pytest.raises(MotionError, match=message):
        MarkerSensor(**CLEAR | wrong)
