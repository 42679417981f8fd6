"""What an image environment tells besides its pictures."""

import numpy as np
import pytest

from tests.envs.playing import begun


def test_the_observation_model_prefers_the_truth():
    for observation in ("mask", "depth"):
        env, _ = begun(observation=observation, seed=4)
        rng = np.random.default_rng(0)
        for _ in range(3):
            truth = env.truth()
            poses = np.concatenate([truth["pose"][None], truth["pose"] + rng.normal(0, 0.3, (50, 25))])
            scores = env.observation_model.log_likelihood(poses)
            assert scores.argmax() == 0
            assert env.observation_model is env.observation_model
            env.step(truth["pose"])


def test_the_observation_model_doesnt_know_the_body():
    env, _ = begun(seed=1)
    assert env.observation_model.skeleton.height != env.truth()["skeleton"].height


@pytest.mark.parametrize("size", [36, 100, 256])
def test_a_picture_to_look_at_is_the_observation_with_larger_pixels(size):
    env, seen = begun(size=size, seed=3)
    shown = env.world.render(0, None)
    times = len(shown) // size
    assert len(shown) >= 256
    assert (times - 1) * size < 256
    np.testing.assert_array_equal(shown[::times, ::times], seen["rgb"])
    np.testing.assert_array_equal(shown, shown[::times, ::times].repeat(times, 0).repeat(times, 1))


def test_observing_again_is_observing_the_same_and_advancing_is_not():
    env, seen = begun(seed=3)
    slots = np.array([0])
    np.testing.assert_array_equal(env.world.observe(slots)["rgb"][0], seen["rgb"])
    env.world.advance(slots)
    assert (env.world.observe(slots)["rgb"][0] != seen["rgb"]).any()


def test_a_model_of_a_new_episode_forgets_the_old_one():
    env, _ = begun(observation="rgb", seed=4)
    old = env.observation_model
    env.reset(seed=5)
    fresh, _ = begun(observation="rgb", seed=5)
    assert env.observation_model is not old
    poses = env.truth()["pose"] + np.random.default_rng(0).normal(0, 0.2, (20, 25))
    np.testing.assert_array_equal(
        env.observation_model.log_likelihood(poses), fresh.observation_model.log_likelihood(poses)
    )
