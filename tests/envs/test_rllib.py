"""RLlib's runner for single agents steps the native vector environments."""

import gymnasium
import numpy as np
import pytest

pytest.importorskip("ray.rllib", reason="RLlib is missing: pip install -e '.[integrations]'")

from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.connectors.env_to_module import FlattenObservations
from ray.rllib.connectors.env_to_module.observation_preprocessor import SingleAgentObservationPreprocessor
from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner

pytestmark = pytest.mark.integration

HORIZON = 10


class FromZeroToOne(SingleAgentObservationPreprocessor):
    """RLlib hands bytes to its convolutions as they are, which PyTorch refuses."""

    def recompute_output_observation_space(self, input_observation_space, input_action_space):
        return gymnasium.spaces.Box(0, 1, input_observation_space.shape, np.float32)

    def preprocess(self, observation, episode):
        return observation / np.float32(255)


@pytest.mark.parametrize(
    ("name", "settings", "connector"),
    [
        ("motionenv/WalkerTracking-v0", {"size": 64, "observation": "rgb"}, FromZeroToOne),
        ("motionenv/MarkerTracking-v0", {}, FlattenObservations),
    ],
)
def test_its_runner_steps_the_vector_environment(name, settings, connector):
    config = PPOConfig().environment(name, env_config={"horizon": HORIZON, **settings})
    config.env_runners(
        num_env_runners=0,
        num_envs_per_env_runner=4,
        gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
        env_to_module_connector=lambda env, spaces, device: connector(),
    )
    runner = SingleAgentEnvRunner(config=config)
    episodes = runner.sample(num_episodes=8)
    assert [len(episode) for episode in episodes] == [HORIZON] * 8
    assert all(episode.is_truncated and not episode.is_terminated for episode in episodes)
    assert all(reward < 0 for episode in episodes for reward in episode.get_rewards())
    runner.stop()
