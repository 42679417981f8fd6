"""RLlib's runner for single agents steps the native vector environments."""

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.wrappers.vector import TransformAction

import motionenv.envs  # noqa: F401 (registers the environments)

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
        return Box(0, 1, input_observation_space.shape, np.float32)

    def preprocess(self, observation, episode):
        return observation / np.float32(255)


def flat_markers(context: dict) -> gymnasium.vector.VectorEnv:
    """RLlib's distributions of actions are flat: estimates (45,) instead of (15, 3)."""
    envs = gymnasium.make_vec(
        "motionenv/MarkerTracking-v1",
        num_envs=context["num_envs"],
        vectorization_mode="vector_entry_point",
        horizon=context["horizon"],
    )
    shape = envs.action_space.shape
    return TransformAction(
        envs, lambda actions: actions.reshape(shape), Box(-100, 100, (shape[0], 45)), Box(-100, 100, (45,))
    )


@pytest.mark.parametrize(
    ("env", "connector"),
    [
        ("motionenv/WalkerTracking-v1", FromZeroToOne),
        ("motionenv/ArmTracking-v1", FromZeroToOne),
        (flat_markers, FlattenObservations),
    ],
)
def test_its_runner_steps_the_vector_environment(env, connector):
    config = PPOConfig().environment(env, env_config={"horizon": HORIZON})
    config.env_runners(
        num_env_runners=0,
        num_envs_per_env_runner=4,
        gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
        env_to_module_connector=lambda env, spaces, device: connector(),
    )
    runner = SingleAgentEnvRunner(config=config)
    assert runner.env.unwrapped.num_envs == 4
    episodes = runner.sample(num_episodes=8)
    assert [len(episode) for episode in episodes] == [HORIZON] * 8
    assert all(episode.is_truncated and not episode.is_terminated for episode in episodes)
    assert all(reward < 0 for episode in episodes for reward in episode.get_rewards())
    runner.stop()
