"""The estimator of ActiveTracking's agents: association against brute force, and beliefs as sure as they are right."""

from itertools import permutations

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from motionenv.envs.active import Still, Sweep
from motionenv.envs.active.filter_kernel import share


def test_association_is_the_sum_over_all_assignments():
    gains = np.random.default_rng(0).normal(0, 2, (1, 4, 3))
    expected = np.zeros((4, 4))
    for people in permutations(range(4), 3):  # whose the detections are
        weight = np.exp(sum(gains[0, k, d] for d, k in enumerate(people)))
        for k in range(4):
            expected[k, 1 + people.index(k) if k in people else 0] += weight
    shares = np.zeros((1, 4, 4))
    share(np.concatenate([gains, np.zeros((1, 4, 1))], axis=-1)[..., :3], np.array([3]), shares)
    np.testing.assert_allclose(shares[0], expected / expected.sum(axis=-1, keepdims=True))


def played(agent, frames: int, n: int = 8, **settings):
    """Distances [m] from the truth and beliefs' standard deviations (frames, n, people), and the agent afterwards."""
    env = gymnasium.make_vec("motionenv/ActiveTracking-v1", num_envs=n, **settings)
    observation, _ = env.reset(seed=0)
    player = agent(env)
    player.reset(observation)
    away, sigmas = [], []
    for _ in range(frames):
        action = player.act(observation)
        places = np.array([truth["positions"] for truth in env.unwrapped.truth()])
        away.append(np.linalg.norm(player.beliefs.means - places, axis=-1))
        sigmas.append(player.beliefs.sigmas.copy())
        observation, *_ = env.step(action)
    return np.array(away), np.array(sigmas), player


def test_people_in_plain_view_are_found_and_others_remain_anywhere():
    away, sigmas, player = played(Still, 12, n=24, pillars=0, colour_noise=0.01, noise=0.01)
    seen = player.beliefs.seen > 0.9
    assert seen.any()
    assert np.median(away[-1][seen]) < 0.3
    assert sigmas[-1][player.beliefs.seen < 0.01].mean() > 3


def test_beliefs_are_as_sure_as_they_are_right():
    """Of the squared distance, 2 σ² is expected in a plane, whether somebody is in view, was, or never has been."""
    away, sigmas, _ = played(Sweep, 200, n=24)
    for low, high in ((0.2, 1.0), (1.0, 3.0), (3.0, 6.0), (6.0, 9.0)):
        these = (sigmas > low) & (sigmas < high)
        assert these.mean() > 0.02
        ratio = np.square(away[these]).mean() / (2 * np.square(sigmas[these]).mean())
        assert 0.6 < ratio < 1.5
