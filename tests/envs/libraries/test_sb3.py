"""Stable-Baselines3 takes the environments: its checker passes, PPO trains on images and on dictionaries."""

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is missing: pip install -e '.[integrations]'")

from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env

import motionenv.envs  # noqa: F401 (registers the environments)

pytestmark = [
    pytest.mark.integration,
    # Advice about what learns well, not about what works: metres aren't from -1 to 1, points aren't a flat vector.
    pytest.mark.filterwarnings("ignore:We recommend you to use a symmetric and normalized Box action space"),
    pytest.mark.filterwarnings("ignore:Your observation .*has an unconventional shape"),
]

IDS = ["motionenv/WalkerTracking-v1", "motionenv/MarkerTracking-v1", "motionenv/ArmTracking-v1"]


@pytest.mark.parametrize("name", IDS)
def test_its_checker_passes(name):
    with gymnasium.make(name, render_mode="rgb_array") as env:
        check_env(env)


@pytest.mark.parametrize(
    ("policy", "name", "settings"),
    [
        ("CnnPolicy", "motionenv/WalkerTracking-v1", {"size": 64, "observation": "rgb"}),
        ("MultiInputPolicy", "motionenv/WalkerTracking-v1", {"size": 48, "observation": ("rgb", "mask")}),
        ("MultiInputPolicy", "motionenv/MarkerTracking-v1", {}),
    ],
)
def test_ppo_trains(policy, name, settings):
    envs = make_vec_env(name, n_envs=4, seed=1, env_kwargs={"horizon": 50, **settings})
    agent = PPO(policy, envs, n_steps=128, batch_size=128, n_epochs=1, seed=1)
    before = {key: value.clone() for key, value in agent.policy.state_dict().items()}
    agent.learn(2048)
    after = agent.policy.state_dict()
    assert agent.num_timesteps == 2048
    assert {episode["l"] for episode in agent.ep_info_buffer} == {50}
    assert all(value.isfinite().all() for value in after.values())
    assert any((after[key] != value).any() for key, value in before.items())
    action, _ = agent.predict(envs.reset(), deterministic=True)
    assert action.shape == (4, *envs.action_space.shape)
    assert np.isfinite(action).all()
    envs.close()
