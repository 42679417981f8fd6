"""The world of ActiveTracking: its score against sampling, its people, and what is seen against the true camera."""

import numpy as np
import pytest

from motionenv.envs.active import ActiveTrackingVector
from motionenv.envs.active.scene_kernel import INNER, OUTER, SPEEDS
from motionenv.envs.active.world import BeliefScale, _energy_score


@pytest.mark.parametrize(("away", "sigma"), [(0.0, 1.0), (0.3, 0.5), (4.0, 0.7), (2.0, 6.0)])
def test_the_score_is_that_of_samples(away, sigma):
    """Against the definition E|X - y| - E|X - X'| / 2 by Monte Carlo."""
    rng = np.random.default_rng(0)
    x, other = sigma * rng.standard_normal((2, 400_000, 2))
    to, apart = np.linalg.norm(x - [away, 0], axis=-1), np.linalg.norm(x - other, axis=-1)
    error = np.hypot(to.std(), apart.std() / 2) / np.sqrt(len(x))
    assert _energy_score(np.array(away), np.array(sigma)) == pytest.approx(to.mean() - apart.mean() / 2, abs=5 * error)


def test_the_score_of_certainty_is_the_distance_and_the_true_spread_is_best():
    assert _energy_score(np.array(30.0), np.array(0.05)) == pytest.approx(30.0, abs=0.05)
    away = np.linalg.norm(np.random.default_rng(0).normal(0, 1.5, (200_000, 2)), axis=-1)
    sigmas = np.array([0.8, 1.2, 1.5, 1.9, 2.5])
    means = [_energy_score(away, np.full(len(away), sigma)).mean() for sigma in sigmas]
    assert sigmas[np.argmin(means)] == 1.5


def test_actions_hold_beliefs():
    rng, scale = np.random.default_rng(0), BeliefScale(4)
    beliefs = np.concatenate([rng.uniform(-13, 13, (5, 4, 2)), rng.uniform(0.06, 9, (5, 4, 1))], axis=-1)
    said = np.concatenate([rng.uniform(-1, 1, (5, 3)), beliefs.reshape(5, -1)], axis=-1)
    np.testing.assert_allclose(scale.estimates(scale.actions(said).astype(float)), said, rtol=2e-5, atol=1e-5)
    assert (np.abs(scale.actions(1e9 * said)) <= 1).all()


def test_people_walk_on_the_square_at_their_pace_and_turn():
    env = ActiveTrackingVector(6, horizon=150, turn_seconds=3.0)
    env.reset(seed=0)
    paths, idle = [], np.zeros(env.action_space.shape, np.float32)
    pillars = env.world.observe(np.arange(6))["pillars"].astype(float)
    for _ in range(150):
        paths.append([truth["positions"] for truth in env.truth()])
        env.step(idle)
    path = np.array(paths)  # (frames, n, people, 2)
    far, pace = np.linalg.norm(path, axis=-1), 10 * np.linalg.norm(np.diff(path, axis=0), axis=-1)
    assert INNER - 0.1 < far.min()
    assert far.max() < OUTER + 0.1
    assert pace.max() < SPEEDS[1] + 1e-6
    assert SPEEDS[0] < np.median(pace) < SPEEDS[1]
    gaps = np.linalg.norm(path[:, :, :, None] - pillars[:, None, :, :2], axis=-1) - pillars[:, None, :, 2]
    assert gaps.min() > 0
    way = np.unwrap(np.arctan2(*np.moveaxis(np.diff(path, axis=0), -1, 0)[::-1]), axis=0)
    assert (np.abs(way[-1] - way[0]) > 0.5).mean() > 0.5


def test_detections_are_where_the_true_camera_projects_the_joints():
    """Without noise to speak of, each detection fits exactly one person by the projection of `types.Camera`."""
    env = ActiveTrackingVector(40, noise=0.001, colour_noise=0.01, dropout=0.0, pillars=0)
    observation, _ = env.reset(seed=0)
    found = 0
    for i, truth in enumerate(env.truth()):
        camera, seen = truth["camera"], observation["seen"][i].astype(bool)
        pixels, depth = camera.project(truth["joints"])
        points = (pixels - [(camera.width - 1) / 2, (camera.height - 1) / 2]) / (camera.width / 2)
        visible = (np.abs(points) <= [1, 0.75]).all(axis=-1) & (depth > 0.3)
        shown = visible[visible.sum(axis=-1) >= 8]
        assert seen.any(axis=-1).sum() == len(shown)
        middles = [observation["points"][i, d, seen[d], 0].mean() for d in range(len(shown))]
        assert middles == sorted(middles)
        for d in range(len(shown)):
            off = [np.abs(points[k] - observation["points"][i, d])[seen[d]].max() for k in range(4)]
            who = int(np.argmin(off))
            assert off[who] < 0.006
            assert np.array_equal(seen[d], visible[who])
            assert np.abs(observation["colours"][i, d] - observation["roster"][i, who, 1:]).max() < 0.05
            found += 1
    assert found > 10
