"""Walking on the spot is what the models do over the ground, seen from the treadmill."""

import numpy as np
import pytest

import motionenv
from motionenv import MotionError
from motionenv.body import feet, limit_excess
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.models.eigenwalkers.locomotion import gait
from motionenv.models.treadmill_cycle import SAMPLES, markers_in_place, walk_in_place
from motionenv.models.types import Walker

PEOPLE = np.concatenate([np.zeros((1, 8)), np.random.default_rng(3).uniform(-2, 2, (5, 8))])


@pytest.fixture(scope="module")
def model():
    return motionenv.load("walk/fpca")


def scores(model, deviations) -> np.ndarray:
    components = model.components()
    return components.means + components.deviations * deviations


@pytest.mark.parametrize("deviations", PEOPLE)
@pytest.mark.parametrize("height", [None, 1.3])
def test_a_cycle_is_what_walking_repeats(model, deviations, height):
    """The second of three strides over the ground, whose ways and turns are taken out."""
    cycle = walk_in_place(model, scores(model, deviations), height=height)
    seconds = float(cycle.seconds)
    walker = Walker(model.kind, scores(model, deviations), seconds)
    walk = model.synthesize(
        3 * seconds, SAMPLES / seconds, walker=walker, variation=0, height=height, phase=0, seed=1
    ).poses
    way = walk[2 * SAMPLES, :2] - walk[SAMPLES, :2]
    turn = np.arctan2(way[1], way[0])
    middle = walk[SAMPLES : 2 * SAMPLES]
    assert cycle.strides == pytest.approx(np.hypot(*way), abs=2e-3)
    np.testing.assert_allclose(cycle.frames[:, 6:], middle[:, 6:], atol=2e-3)
    np.testing.assert_allclose(cycle.frames[:, 2], middle[:, 2], atol=2e-3)
    np.testing.assert_allclose(cycle.frames[:, 5], middle[:, 5] - turn, atol=5e-3)
    even = np.arange(SAMPLES)[:, None] / SAMPLES * way
    c, s = np.cos(turn), np.sin(turn)
    swaying = (middle[:, :2] - even) @ np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(cycle.frames[:, :2], swaying - swaying.mean(axis=0), atol=3e-3)


@pytest.mark.parametrize("deviations", PEOPLE)
def test_standing_feet_go_back_with_the_ground(model, deviations):
    """No foot slips on the moving ground, floats or goes through it, and no joint bends backwards."""
    body = model.skeleton()
    cycle = walk_in_place(model, scores(model, deviations))
    ankles, balls = feet(cycle.frames, body)
    assert balls[..., 2].min() > 0
    assert ankles[..., 2].min() > ANKLE_HEIGHT * body.height - 0.03
    lower = np.argmin(balls[..., 2], axis=1)
    at = np.arange(SAMPLES)
    back = 0.5 * (np.roll(balls, 1, 0) - np.roll(balls, -1, 0))[at, lower, 0] * SAMPLES
    still = (lower == np.roll(lower, 1)) & (lower == np.roll(lower, -1))
    slip = np.abs(back[still] / float(cycle.strides) - 1)
    assert np.median(slip) < 0.1
    assert limit_excess(cycle.frames)[:, [12, 16, 20, 24]].min() >= 0


def test_a_speed_is_kept_exactly(model):
    for speed in (0.4, 1.2, 2.5):
        cycle = walk_in_place(model, scores(model, PEOPLE), speed=speed)
        np.testing.assert_allclose(cycle.speeds, speed, rtol=1e-12)


def test_many_are_each_one(model):
    together = walk_in_place(model, scores(model, PEOPLE).reshape(2, 3, 8))
    assert together.frames.shape == (2, 3, SAMPLES, 25)
    alone = walk_in_place(model, scores(model, PEOPLE[4]))
    np.testing.assert_allclose(together.frames[1, 1], alone.frames, atol=1e-12)
    assert together.seconds[1, 1] == pytest.approx(float(alone.seconds))


@pytest.mark.parametrize("deviations", np.random.default_rng(4).uniform(-1.5, 1.5, (5, 10)))
def test_eigenwalkers_go_as_far_as_their_bodies_do(deviations):
    """Told from markers alone, strides are within 2 % of those of the fitted body, and they sway alike within 4 cm."""
    model = motionenv.load("walk/eigenwalkers")
    k = scores(model, deviations)
    cycle = markers_in_place(model, k)
    body = gait(model.inverse_transform(k))
    assert float(cycle.strides) == pytest.approx(body.stride_length, rel=0.02)
    assert float(cycle.seconds) == pytest.approx(1 / float(model.frequency(k)))
    phase = np.arange(SAMPLES) * 2 * np.pi / SAMPLES
    there = body.positions(phase)
    there[..., 0] -= body.stride_length * np.arange(SAMPLES)[:, None] / SAMPLES
    there[..., :2] -= there[:, [2], :2].mean(axis=0) - cycle.frames[:, [2], :2].mean(axis=0)
    np.testing.assert_allclose(cycle.frames, there, atol=0.04)


@pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros(()), np.full(8, np.nan)])
def test_other_scores_are_refused(model, wrong):
    with pytest.raises(MotionError, match="scores"):
        walk_in_place(model, wrong)


@pytest.mark.parametrize("speed", [0.0, 9.0, np.nan])
def test_no_speed_of_walking_is_refused(model, speed):
    with pytest.raises(MotionError, match="speed"):
        walk_in_place(model, np.zeros(8), speed=speed)
    with pytest.raises(MotionError, match="speed"):
        markers_in_place(motionenv.load("walk/eigenwalkers"), np.zeros(10), speed=speed)
