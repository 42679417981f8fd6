"""ActiveTracking: Gymnasium's checks, the vector environment against single ones, and that no lazy policy gains."""

import pickle
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

from motionenv.envs import ActiveTracking, ActiveTrackingVector
from motionenv.envs.active.scene_kernel import INNER, OUTER, SPEEDS
from motionenv.envs.active.tracking import BeliefScale, _energy_score
from motionenv.envs.tasks import TASKS
from motionenv.errors import MotionError

ID = "motionenv/ActiveTracking-v1"


@pytest.mark.parametrize(
    "settings", [{"people": 1, "pillars": 0}, TASKS["motionenv/ActiveTracking-Hard-v1"].settings], ids=str
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
    envs = [ActiveTracking(people=8, pillars=0, blur=0) for _ in range(2)]
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
        {"blur": -1}, {"turn_seconds": "2"}, {"effort": -1}, {"fps": 0}, {"horizon": 2.5}, {"split": "test"},
        {"render_mode": "ansi"},
    ],
    ids=str,
)  # fmt: skip
def test_impossible_arguments_are_refused_by_name(wrong):
    for make in (ActiveTracking, partial(ActiveTrackingVector, 2)):
        with pytest.raises(MotionError, match=next(iter(wrong))):
            make(**wrong)


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
    env = ActiveTrackingVector(80, noise=0.001, colour_noise=0.01, dropout=0.0, pillars=0)
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
            off = [np.abs(points[k] - observation["points"][i, d])[seen[d]].max() for k in range(3)]
            who = int(np.argmin(off))
            assert off[who] < 0.006
            assert np.array_equal(seen[d], visible[who])
            assert np.abs(observation["colours"][i, d] - observation["roster"][i, who, 1:]).max() < 0.05
            found += 1
    assert found > 10
