"""PPO of Stable-Baselines3 on the named tasks, with a discount of 0: actions never change what is seen."""

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

SPREAD = -2.0  # log of the first standard deviation of actions
ENVS, STEPS, BATCH, EPOCHS = 16, 64, 256, 4


class Played:
    """A policy as an agent.

    Args:
        policy: with `predict`.
    """

    def __init__(self, policy):
        self.policy = policy

    def reset(self, observation, began=None) -> None:
        """Nothing to forget."""

    def act(self, observation) -> np.ndarray:
        """The policy's mean action."""
        return self.policy.predict(observation, deterministic=True)[0]


def improve(task: str, frames: int, gamma: float = 0.0, seed: int = 0) -> Played:
    """PPO's policy after so many frames, rounded up to whole rollouts.

    Args:
        task: an id.
        frames: of split "train", of all environments together.
        gamma: discount.
        seed: of the policy and the episodes.
    """
    torch.set_num_threads(1)
    envs = make_vec_env(task, n_envs=ENVS, seed=seed, env_kwargs={"split": "train"})
    shape = envs.observation_space.shape
    kind = "MultiInputPolicy" if shape is None else "CnnPolicy" if len(shape) == 3 else "MlpPolicy"
    how = {"log_std_init": SPREAD}
    agent = PPO(
        kind, envs, gamma=gamma, n_steps=STEPS, batch_size=BATCH, n_epochs=EPOCHS, seed=seed, policy_kwargs=how,
        device="cpu",
    )  # fmt: skip
    agent.learn(frames)
    envs.close()
    return Played(agent.policy)
