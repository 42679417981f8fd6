"""Walkers before backgrounds that nobody knows: found once these are, doubted until then."""

import gymnasium
import numpy as np
import pytest

from motionenv.envs.agents import TrackingAgent, searching, truth_start
from motionenv.envs.walker import WalkerTracking
from motionenv.likelihoods.background import cluttered
from motionenv.tracking import Belief

CLUTTER = {"observation": "rgb", "background": "clutter", "noise": 6.0, "size": 64, "horizon": 44}


def played(env, seed, **options):
    """Beliefs about an episode's frames, and their errors [m]."""
    agent = TrackingAgent(env, seed=0, threads=1, **options)
    observation, _ = env.reset(seed=seed)
    agent.reset(observation)
    beliefs, errors, done = [], [], False
    while not done:
        action = agent.act(observation)
        beliefs.append(agent.beliefs[0])
        observation, _, terminated, truncated, info = env.step(action)
        errors.append(info["error"])
        done = terminated or truncated
    return agent, beliefs, np.array(errors)


@pytest.mark.parametrize("seed", [2, 5, 7])
def test_a_walker_is_found_once_the_background_is_known(seed):
    agent, beliefs, errors = played(WalkerTracking(**CLUTTER, camera="side"), seed, keep=True)
    assert errors[:2].mean() > 1.0
    assert errors[-12:].mean() < 0.2
    assert len(agent.smoothed(20)[0]) == len(beliefs)


def test_until_then_he_is_somewhere_about_the_origin():
    _, beliefs, _ = played(WalkerTracking(**CLUTTER, camera="side"), 1, n=500)
    for belief in beliefs[:2]:
        assert np.abs(belief.mean[:2]).max() < 0.5
        assert np.std(belief.poses[:, :2], axis=0).min() > 1.5


def test_nobody_is_found_in_pictures_of_nothing():
    env = WalkerTracking(**CLUTTER)
    observation, _ = env.reset(seed=3)
    agent = TrackingAgent(env, n=200, seed=0, threads=1)
    agent.reset(observation)
    empty, rng = np.random.default_rng(0).integers(0, 256, observation.shape), np.random.default_rng(1)
    for _ in range(40):
        agent.act(np.clip(empty + rng.normal(0, 6, empty.shape), 0, 255).astype(np.uint8))
    belief: Belief = agent.beliefs[0]
    assert np.abs(belief.mean[:2]).max() < 0.7
    assert belief.lost


@pytest.mark.parametrize(("seed", "alone", "hidden"), [(2001, 0, 0.7), (2023, 0, 0.7), (2001, 1, 0.9)])
def test_nobody_is_followed_out_of_the_picture_or_far_from_where_people_walk(seed, alone, hidden, monkeypatch):
    """Without these bounds, a passer-by was: by twenty pixels and more, and at a third of the walker's distance.

    The last one left the picture as its last frames were seen anew.
    """
    monkeypatch.setitem(searching._HIDDEN, "hidden", hidden)
    env = gymnasium.make("motionenv/WalkerTracking-Hard-v2", split="train", alone=alone)
    _, beliefs, _ = played(env, seed, n=300)
    camera = env.unwrapped.truth()["camera"]
    for belief in beliefs:
        pixels, _ = camera.project(np.array([[*belief.mean[:2], 1.0]]))
        away, usual = np.linalg.norm([belief.mean[:2] - camera.centre[:2], camera.centre[:2]], axis=1)
        wide = np.std(belief.poses[:, :2], axis=0).min() > 1.5
        assert wide or (-1 < pixels[0, 0] < camera.width and 0.5 < away / usual < 2)


def test_the_same_seed_says_the_same():
    env = WalkerTracking(**CLUTTER)
    first, second = (played(env, 4, n=200)[2] for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_given_start_and_a_plain_wall_are_as_before():
    assert played(WalkerTracking(**CLUTTER, camera="side"), 1, start=truth_start)[2][:6].mean() < 0.1
    plain = CLUTTER | {"background": "plain"}
    assert played(WalkerTracking(**plain, camera="side"), 1)[2][:6].mean() < 0.4


def test_things_before_a_plain_wall_are_not_taken_for_a_walker():
    """They were: with the wall's colours as background, whatever stands before it was somebody near, off by metres."""
    plain = CLUTTER | {"background": "plain", "noise": 0.0, "occluders": 2}
    errors = np.array([played(WalkerTracking(**plain), seed, n=300)[2] for seed in (2, 3, 5)])
    assert errors[:, :6].mean() < 2.0
    assert np.median(errors[:, -12:]) < 1.0


@pytest.mark.parametrize(
    ("changed", "said"),
    [({}, True), ({"background": "plain"}, False), ({"background": "plain", "occluders": 2}, True)],
)
def test_which_pictures_are_cluttered(changed, said):
    env = gymnasium.make("motionenv/WalkerTracking-v1", **CLUTTER | {"noise": 8.0} | changed)
    assert [cluttered(env.reset(seed=seed)[0]) for seed in range(5)] == [said] * 5
