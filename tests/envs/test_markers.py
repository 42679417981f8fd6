"""MarkerTracking: Gymnasium's checks, the vector environment against single ones, observations against the truth."""

import pickle

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from motionenv.envs.markers import MarkerTracking, MarkerTrackingVector
from motionenv.errors import MotionError
from tests.envs.playing import episode, flat


@pytest.mark.parametrize("settings", [{}, {"distance": 4.0, "view": (-30, 30)}, {"motion": "walk/fpca", "horizon": 30}])
def test_gymnasium_finds_nothing_wrong(settings):
    check_env(MarkerTracking(render_mode="rgb_array", **settings), skip_render_check=True)


@pytest.mark.parametrize("settings", [{}, {"distance": 3.0}, {"height": (1.5, 2.0), "speed": (0.8, 1.6), "view": 20}])
def test_the_vector_environment_is_many_single_ones(settings):
    settings = {"horizon": 12, "lost_after": 0.4, **settings}
    for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
        single = SyncVectorEnv([lambda: MarkerTracking(**settings)] * 5, autoreset_mode=mode)
        native = MarkerTrackingVector(5, autoreset_mode=mode, **settings)
        rng = np.random.default_rng(0)
        a, b = single.reset(seed=7)[0], native.reset(seed=7)[0]
        for _ in range(40):
            np.testing.assert_array_equal(a["points"], b["points"])
            np.testing.assert_array_equal(a["seen"], b["seen"])
            guess = rng.uniform(-0.5, 0.5, (5, 15, 3)).astype(np.float32)
            (a, *rest_a, _), (b, *rest_b, _) = single.step(guess), native.step(guess)
            for x, y in zip(rest_a, rest_b, strict=True):
                np.testing.assert_array_equal(x, y)


def test_observations_are_in_their_space_and_errors_are_of_the_frame_before():
    env = MarkerTracking(horizon=40, noise=0.03, dropout=0.2, gaps=0.2)
    observed, truths, errors = episode(env, 5)
    assert all(env.observation_space.contains(seen) for seen in observed)
    expected = [
        np.linalg.norm(flat(seen) - truth["joints"], axis=-1).mean()
        for seen, truth in zip(observed, truths, strict=True)
    ]
    np.testing.assert_allclose(errors, expected[:-1], atol=1e-6)


def test_truth_is_the_callers_own():
    env = MarkerTracking()
    env.reset(seed=0)
    env.unwrapped.truth()["joints"][:] = 0
    assert env.unwrapped.truth()["joints"].any()


def test_pictures_show_the_estimate():
    env = MarkerTracking(render_mode="rgb_array")
    observed, _ = env.reset(seed=0)
    alone = env.render()
    assert alone.dtype == np.uint8
    assert min(alone.shape[:2]) >= 256
    env.step(env.action(flat(observed)))
    over = env.render()
    lit = alone.max(axis=-1) > 0
    assert (over[lit].max(axis=-1) > 0).all()  # the dots of frame 0, under lines that connect them
    assert (over[~lit].max(axis=-1) > 0).any()


def test_pickled_environments_go_on_where_they_were():
    env = MarkerTracking()
    env.reset(seed=0)
    env.step(np.zeros((15, 3), np.float32))
    copy = pickle.loads(pickle.dumps(env))
    for _ in range(5):
        a, b = (e.step(np.zeros((15, 3), np.float32)) for e in (env, copy))
        np.testing.assert_array_equal(a[0]["points"], b[0]["points"])
        assert a[1:] == b[1:]


@pytest.mark.parametrize(
    "wrong",
    [
        {"noise": -1}, {"dropout": 2}, {"gaps": "some"}, {"distance": 0.5}, {"view": (30, -30)}, {"view": "side"},
        {"view": np.nan}, {"view": True}, {"horizon": 0}, {"horizon": 2.5}, {"fps": 0}, {"split": "test"},
        {"motion": "walk/nobody"}, {"height": (1.8, 1.6)}, {"speed": (0, 9)}, {"lost_after": -1},
        {"render_mode": "ansi"},
    ],
    ids=str,
)  # fmt: skip
def test_impossible_arguments_are_refused_by_name(wrong):
    for make in (MarkerTracking, lambda **settings: MarkerTrackingVector(2, **settings)):
        with pytest.raises(MotionError, match=next(iter(wrong))):
            make(**wrong)


def test_a_number_of_environments_that_is_none_is_refused():
    with pytest.raises(MotionError, match="num_envs"):
        MarkerTrackingVector(0)
