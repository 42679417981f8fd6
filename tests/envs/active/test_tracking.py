"""ActiveTracking: Gymnasium's checks, the vector environment against single ones, and that no lazy policy gains."""

import pickle
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

from motionenv.envs import ActiveTracking, ActiveTrackingVector
from motionenv.envs.tasks import TASKS
from motionenv.errors import MotionError

ID = "motionenv/ActiveTracking-v0"


@pytest.mark.parametrize(
    "settings", [{"people": 1, "pillars": 0}, TASKS["motionenv/ActiveTracking-Hard-v0"].settings], ids=str
)
def test_gymnasium_finds_nothing_wrong(settings):
    check_env(gymnasium.make(ID, render_mode="rgb_array", **{**settings, "horizon": 20}).unwrapped)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_vector_environment_is_many_single_ones_to_the_bit(mode):
    settings = {"horizon": 7, "people": 3, "turn_seconds": 1.0}
    single = SyncVectorEnv([partial(ActiveTracking, **settings)] * 4, autoreset_mode=mode)
    native = ActiveTrackingVector(4, autoreset_mode=mode, **settings)
    assert data_equivalence(single.reset(seed=7), native.reset(seed=7), exact=True)
    native.action_space.seed(0)
    for _ in range(20):
        actions = native.action_space.sample()
        a, b = single.step(actions), native.step(actions)
        assert data_equivalence(a[:4], b[:4], exact=True)
        if mode == AutoresetMode.DISABLED and a[3].any():
            options = {"reset_mask": a[3]}
            again = [env.reset(options=dict(options))[0] for env in (single, native)]
            assert data_equivalence(*again, exact=True)


def test_other_processes_see_the_same():
    away = AsyncVectorEnv([partial(gymnasium.make, f"motionenv.envs:{ID}", horizon=5)] * 2)
    native = gymnasium.make_vec(ID, num_envs=2, horizon=5)
    try:
        assert data_equivalence(away.reset(seed=3)[0], native.reset(seed=3)[0], exact=True)
        for _ in range(8):
            actions = native.action_space.sample()
            assert data_equivalence(away.step(actions)[:4], native.step(actions)[:4], exact=True)
    finally:
        away.close()


def test_commands_change_what_is_seen():
    envs = [ActiveTracking(pillars=0), ActiveTracking(pillars=0)]
    for env, rate in zip(envs, (0.0, 1.0), strict=True):
        env.reset(seed=0)
        for _ in range(12):
            action = np.zeros(env.action_space.shape, np.float32)
            action[0] = rate
            observation, *_ = env.step(action)
        env.last = observation
    assert not np.array_equal(envs[0].last["points"], envs[1].last["points"])
    assert np.array_equal(envs[0].truth()["joints"], envs[1].truth()["joints"])  # people don't mind the camera


def test_pickled_environments_go_on_where_they_were():
    env = ActiveTracking()
    env.reset(seed=0)
    copy = pickle.loads(pickle.dumps(env))
    action = np.full(env.action_space.shape, 0.3, np.float32)
    for _ in range(5):
        assert data_equivalence(env.step(action), copy.step(action), exact=True)


def returns(belief, n=24, horizon=100) -> float:
    """Mean reward of a policy whose beliefs are `belief(positions)`, with a still camera."""
    envs = ActiveTrackingVector(n, horizon=horizon)
    envs.reset(seed=5)
    total = 0.0
    for _ in range(horizon):
        positions = np.stack([truth["positions"] for truth in envs.truth()])
        means, sigmas = belief(positions)
        people = np.concatenate([means, sigmas[..., None]], axis=-1).reshape(n, -1)
        total += envs.step(envs.action(np.insert(people, [0, 0, 0], 0.0, axis=-1)))[1].mean()
    return total / horizon


def test_no_policy_gains_by_failing_or_by_a_false_confidence():
    """A belief that ignores everything is worth least if it is sure or wrong, and any knowledge is worth more."""
    spread = lambda sigma: lambda at: (0 * at, np.full(at.shape[:2], sigma))
    prior = returns(spread(6.0))
    assert all(returns(spread(sigma)) < prior - 0.3 for sigma in (0.05, 1.0, 2.0))
    far = returns(lambda at: (np.full_like(at, 15.0), np.full(at.shape[:2], 0.05)))
    known = returns(lambda at: (at + 0.5, np.full(at.shape[:2], 0.5)))
    assert far < 2 * prior
    assert prior < -4
    assert known > -0.6


def test_episodes_end_by_time_only():
    env = ActiveTracking(horizon=30)
    env.reset(seed=0)
    worst = np.ones(env.action_space.shape, np.float32)
    ends = [env.step(worst)[2:4] for _ in range(30)]
    assert ends == [(False, False)] * 29 + [(False, True)]


@pytest.mark.parametrize(
    "wrong",
    [
        {"people": 0}, {"people": 9}, {"pillars": -1}, {"noise": 0}, {"colour_noise": np.nan}, {"dropout": 1},
        {"turn_seconds": "2"}, {"effort": -1}, {"fps": 0}, {"horizon": 2.5}, {"split": "test"},
        {"render_mode": "ansi"},
    ],
    ids=str,
)  # fmt: skip
def test_impossible_arguments_are_refused_by_name(wrong):
    for make in (ActiveTracking, partial(ActiveTrackingVector, 2)):
        with pytest.raises(MotionError, match=next(iter(wrong))):
            make(**wrong)
