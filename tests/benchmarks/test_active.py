"""The estimator of ActiveTracking's policies: association against brute force, and people in plain view."""

from itertools import permutations

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks.envs.active.filter_kernel import share
from benchmarks.envs.active.policies import Policy


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


def test_people_in_plain_view_are_found_and_others_remain_anywhere():
    env = gymnasium.make_vec("motionenv/ActiveTracking-v1", num_envs=8, pillars=0, colour_noise=0.01, noise=0.01)
    observation, _ = env.reset(seed=0)
    policy = Policy(env)
    policy.reset(observation)
    for _ in range(12):
        observation, *_ = env.step(policy.act(observation))
    policy.beliefs.update(observation)
    away = np.linalg.norm(policy.beliefs.means - [truth["positions"] for truth in env.unwrapped.truth()], axis=-1)
    seen = policy.beliefs.seen > 0.9
    assert seen.any()
    assert np.median(away[seen]) < 0.4
    assert policy.beliefs.sigmas[policy.beliefs.seen < 0.01].mean() > 3
