"""The native vector environment does what Gymnasium's own does with single environments."""

import itertools
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from motionenv.envs import WalkerTrackingVector
from motionenv.errors import MotionError

pytest.importorskip("gymnasium", minversion="1.4", reason="its checks of environments are new in Gymnasium 1.4")

from gymnasium.utils.env_checker import data_equivalence, data_shares_objects

N = 5


def actions_for(kind, envs, rng) -> np.ndarray:
    """Mostly bad estimates, now and then a perfect one: tracks are lost and found again, at different times."""
    actions = envs.action_space.sample()
    for i, truth in enumerate(envs.truth()):
        if rng.random() < 0.12:
            actions[i] = kind.perfect(truth)
    return actions


def same(a, b) -> bool:
    """Equal to the last bit, of the same types and keys, in depth; object arrays compared entry by entry."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, np.ndarray) and a.dtype == object:
        return b.dtype == object and a.shape == b.shape and all(same(x, y) for x, y in zip(a, b, strict=True))
    return type(a) is type(b) and data_equivalence(a, b, exact=True)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_equals_gymnasiums_sync_vector_of_single_environments(kind, mode):
    ours = kind.vector(N, autoreset_mode=mode, lost_after=0.05, threads=2)
    theirs = SyncVectorEnv([partial(kind.single, lost_after=0.05)] * N, autoreset_mode=mode)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"] == ours.autoreset_mode == mode
    assert same(ours.reset(seed=3), theirs.reset(seed=3))
    ours.action_space.seed(1)
    rng, ends, lost = np.random.default_rng(0), [], 0
    for step in range(50):
        if step in (4, 9):  # from here on episodes end at different times
            options = {"reset_mask": np.arange(N) % 3 == step % 3}
            assert same(ours.reset(options=options), theirs.reset(options=dict(options)))
        actions = actions_for(kind, ours, rng)
        mine, other = ours.step(actions), theirs.step(actions)
        for name, a, b in zip(
            ("observations", "rewards", "terminated", "truncated", "infos"), mine, other, strict=True
        ):
            assert same(a, b), f"{name} differ in step {step}: {a} and {b}"
        ended = mine[3]
        ends.append(ended.sum())
        lost += np.sum(mine[4].get("lost", 0))
        if mode == AutoresetMode.DISABLED and ended.any():
            with pytest.raises(ResetNeeded, match="environments"):
                ours.step(actions)
            seeds = [100 + step if i % 2 else None for i in range(N)]
            options = {"reset_mask": ended}
            assert same(ours.reset(seed=seeds, options=options), theirs.reset(seed=list(seeds), options=dict(options)))
    assert 0 < min(n for n in ends if n) < N
    assert lost > 0


def test_seeds_are_as_in_sync_vector(kind):
    envs, single = kind.vector(3), kind.single()
    observed, _ = envs.reset(seed=[7, None, 9])
    alone, _ = single.reset(seed=9)
    assert same(take(observed, 2), alone)
    assert envs.np_random_seed[0] == 7
    first, _ = envs.reset(seed=[7, None, 9])
    again, _ = envs.reset(seed=[7, None, 9])
    assert same(take(first, 0), take(observed, 0))
    assert not same(take(first, 1), take(again, 1))  # goes on with what it had


def take(observed, i: int):
    return {k: v[i] for k, v in observed.items()} if isinstance(observed, dict) else observed[i]


def test_returned_arrays_are_nobody_elses(kind):
    envs = kind.vector(3, autoreset_mode="SameStep")
    kept = [envs.reset(seed=0)]
    for _ in range(17):
        kept.append(envs.step(0 * envs.action_space.sample()))
    arrays = [list(arrays_in(step)) for step in kept]
    for i in range(len(arrays)):
        for a in arrays[i]:
            assert not any(np.shares_memory(a, b) for later in arrays[i + 1 :] for b in later)
            assert not any(a is not b and np.shares_memory(a, b) for b in arrays[i])
            a[...] = 0  # spoiling what was returned changes nothing inside
    assert not any(data_shares_objects(a, b) for a, b in itertools.pairwise(kept))
    fresh = kind.vector(3)
    before, _ = fresh.reset(seed=4)
    assert same(before, envs.reset(seed=4)[0])


def arrays_in(thing):
    if isinstance(thing, np.ndarray) and thing.dtype != object:
        yield thing
    elif isinstance(thing, dict):
        for value in thing.values():
            yield from arrays_in(value)
    elif isinstance(thing, tuple | list) or isinstance(thing, np.ndarray):
        for value in thing:
            yield from arrays_in(value)


def test_any_number_of_threads_gives_the_same(kind):
    one, four = kind.vector(9, threads=1), kind.vector(9, threads=4)
    assert same(one.reset(seed=1), four.reset(seed=1))
    for _ in range(3):
        actions = 0 * one.action_space.sample()
        assert same(one.step(actions), four.step(actions))


def test_a_bad_action_is_named_and_changes_nothing(kind):
    envs, twin = kind.vector(3), kind.vector(3)
    with pytest.raises(ResetNeeded):
        envs.step(envs.action_space.sample())
    envs.reset(seed=1), twin.reset(seed=1)
    good = 0 * envs.action_space.sample()
    bad = good.copy()
    bad[(1, *[0] * (bad.ndim - 1))] = np.nan
    for actions, why in [
        (bad, r"action\[0.*\] of environment 1 must be finite.*got .*nan"),
        (good + 1e4, "must be finite and from"),
        (good[:2], r"shape \(3, ...\)"),
        (good[..., :1][..., None, None], "shape"),
        (good.astype(complex), "numbers"),
        (np.full(good.shape, None), "numbers"),
        ([[1.0, 2.0], [3.0]], "lists of different lengths"),
    ]:
        with pytest.raises(MotionError, match=why):
            envs.step(actions)
    assert same(envs.step(good), twin.step(good))


def test_actions_of_environments_that_are_reset_dont_matter(kind):
    envs = kind.vector(2)
    envs.reset(seed=0)
    good = 0 * envs.action_space.sample()
    for _ in range(15):
        *_, truncated, _ = envs.step(good)
    assert truncated.all()
    _, rewards, terminated, truncated, infos = envs.step(good + np.nan)
    assert (rewards.tolist(), terminated.any(), truncated.any(), infos) == ([0.0, 0.0], False, False, {})


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"reset_mask": [True, False]}, MotionError),
        ({"reset_mask": np.array([True])}, MotionError),
        ({"reset_mask": np.array([1, 0])}, MotionError),
        ({"reset_mask": np.array([False, False])}, MotionError),
    ],
)
def test_a_mask_that_is_none_is_refused(options, error):
    envs = WalkerTrackingVector(2, size=36)
    with pytest.raises(ResetNeeded, match="once"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    envs.reset(seed=0)
    with pytest.raises(error, match="reset_mask"):
        envs.reset(options=options)


@pytest.mark.parametrize(
    "arguments", [{"num_envs": 0}, {"num_envs": 2.5}, {"autoreset_mode": "Never"}, {"threads": -1}, {"threads": 1.5}]
)
def test_an_impossible_vector_is_named(arguments):
    with pytest.raises(MotionError, match=next(iter(arguments))):
        WalkerTrackingVector(**{"num_envs": 2, "size": 36, **arguments})


def test_seeds_must_go_with_the_environments():
    envs = WalkerTrackingVector(2, size=36)
    with pytest.raises(MotionError, match="seed"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(gymnasium.error.Error, match="Seed"):
        envs.reset(seed=[1, -2])


def test_pictures_of_all_environments():
    envs = WalkerTrackingVector(2, size=64, render_mode="rgb_array", actions="metric")
    with pytest.raises(ResetNeeded):
        envs.render()
    with pytest.raises(ResetNeeded):
        envs.truth()
    envs.reset(seed=0)
    plain = envs.render()
    envs.step(np.stack([truth["pose"] for truth in envs.truth()]))
    drawn = envs.render()
    assert [p.shape for p in (*plain, *drawn)] == [(256, 256, 3)] * 4
    for before, after in zip(plain, drawn, strict=True):
        share = (before != after).any(-1).mean()
        assert 0.002 < share < 0.2  # the same frame, with lines over it
    assert WalkerTrackingVector(2, size=36).render() is None
    envs.close()
    envs.close()


NAMES = ["action_space", "observation_space", "render_mode", "lost_after", "np_random_seed", "render", "metadata"]


def test_attributes_are_those_of_single_environments(kind):
    ours = kind.vector(3, lost_after=0.05)
    theirs = SyncVectorEnv([partial(kind.single, lost_after=0.05)] * 3)
    for envs in (ours, theirs):
        envs.reset(seed=4)
    for name in NAMES:
        mine, other = ours.get_attr(name), theirs.get_attr(name)
        assert type(mine) is tuple
        assert mine == other or name == "metadata"
    for mine, other in zip(ours.call("truth"), theirs.call("truth"), strict=True):
        assert mine.keys() == other.keys()
        np.testing.assert_array_equal(mine["joints"], other["joints"])
    action = ours.single_action_space.sample()
    for mine, other in zip(ours.call("estimate", action), theirs.call("estimate", action), strict=True):
        np.testing.assert_array_equal(mine, other)
    poses = np.stack([truth["pose"] for truth in ours.call("truth")])
    for mine, other in zip(ours.get_attr("observation_model"), theirs.get_attr("observation_model"), strict=True):
        np.testing.assert_array_equal(mine.log_likelihood(poses), other.log_likelihood(poses))
    for generator, other in zip(ours.get_attr("np_random"), theirs.get_attr("np_random"), strict=True):
        assert generator.random() == other.random()


def test_attributes_are_set_for_all():
    ours = WalkerTrackingVector(3, observation="mask", size=36, horizon=12, lost_after=9.0)
    ours.reset(seed=0)
    for values in (0.01, [0.01] * 3, (0.01,) * 3):
        ours.set_attr("lost_after", values)
        assert ours.get_attr("lost_after") == (0.01,) * 3
    infos = [ours.step(np.ones(ours.action_space.shape))[-1]["lost"].all() for _ in range(10)]
    assert infos == [False] * 9 + [True]
    for values in ([0.1, 0.2, 0.1], [0.1] * 2):
        with pytest.raises(MotionError, match="values must be one for all of 3 environments, which share lost_after"):
            ours.set_attr("lost_after", values)
    with pytest.raises(MotionError, match="lost_after must be"):
        ours.set_attr("lost_after", -1.0)


def test_what_acts_on_all_at_once_or_isnt_there_is_refused():
    ours = WalkerTrackingVector(2, observation="mask", size=36)
    with pytest.raises(ResetNeeded):
        ours.call("truth")
    with pytest.raises(MotionError, match=r"step acts on all environments of a WalkerTrackingVector: call step\(\)"):
        ours.call("step", None)
    with pytest.raises(AttributeError, match="nothing"):
        ours.get_attr("nothing")
