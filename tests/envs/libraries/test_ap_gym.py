"""ActiveTracking as an environment of ap_gym (Schneider et al. 2025), which tells predictions from actions.

`ActivePerception` is all that it takes: the commands to the camera are ap_gym's action, the beliefs its prediction, the
energy score its loss, and the cost of effort its base reward. The other environments are left out: nothing that their
agents do changes what they see, so they have predictions, but no actions.
"""

from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from scipy import special

ap_gym = pytest.importorskip("ap_gym", reason="ap_gym is missing: pip install ap-gym")
torch = pytest.importorskip("torch", reason="PyTorch is missing: pip install -e '.[agents]'")

import motionenv.envs  # noqa: E402, F401 (registers the environments)

pytestmark = pytest.mark.integration
COMMANDS = 3  # pan, tilt and zoom
TASK = next(name for name in gymnasium.registry if name.startswith("motionenv/ActiveTracking-Easy"))


class ActivePerception(ap_gym.ActivePerceptionEnv):
    """A single ActiveTracking `env`; targets are the positions (people, 2) that actions say."""

    def __init__(self, env: gymnasium.Env) -> None:
        self.env, size = env, env.action_space.shape[0]
        box = lambda *shape: spaces.Box(-1.0, 1.0, shape, np.float32)
        self.action_space = ap_gym.ActivePerceptionActionSpace(box(COMMANDS), box(size - COMMANDS))
        self.observation_space = env.observation_space
        self.prediction_target_space = box((size - COMMANDS) // 3, 2)
        numpy = SimpleNamespace(sqrt=np.sqrt, i0e=special.i0e, i1e=special.i1e)
        torches = SimpleNamespace(sqrt=torch.sqrt, i0e=torch.special.i0e, i1e=torch.special.i1e)
        self.loss_fn = ap_gym.LambdaLossFn(
            lambda said, target, batch: self._energy(numpy, said, target),
            lambda said, target, batch: self._energy(torches, said, target),
            lower_bound=0.0,
        )

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, {**info, "prediction": {"target": self._target()}}

    def _step(self, action, prediction):
        target = self._target()
        observation, reward, *ends, info = self.env.step(np.concatenate([action, prediction]))
        return observation, reward + float(self.loss_fn.numpy(prediction, target)), *ends, info, target

    def _target(self) -> np.ndarray:
        places = self.env.unwrapped.truth()["positions"]
        beliefs = np.insert(places, 2, 1.0, axis=-1).ravel()
        return self.env.unwrapped.action(np.concatenate([np.zeros(COMMANDS), beliefs]))[COMMANDS:].reshape(-1, 3)[:, :2]

    def _energy(self, xp, said, target):
        """Energy score [m] of Gaussian beliefs, as ActiveTracking's docstring has actions and rewards."""
        beliefs = said.reshape(*said.shape[:-1], -1, 3)
        sigma = 0.05 * 200.0 ** ((beliefs[..., 2] + 1) / 2)
        half = 15.0**2 * ((beliefs[..., :2] - target) ** 2).sum(-1) / sigma**2 / 4
        rice = (np.pi / 2) ** 0.5 * ((1 + 2 * half) * xp.i0e(half) + 2 * half * xp.i1e(half))
        return (sigma * (rice - np.pi**0.5 / 2)).mean(-1)


def test_rewards_are_the_environments_and_the_loss_is_differentiable():
    env, plain = ActivePerception(gymnasium.make(TASK)), gymnasium.make(TASK)
    seen, info = env.reset(seed=3)
    plain.reset(seed=3)
    assert env.observation_space.contains(seen)
    effort = plain.unwrapped.arguments.effort
    env.action_space.seed(0)
    for _ in range(20):
        target, action = info["prediction"]["target"], env.action_space.sample()
        assert env.prediction_target_space.contains(target)
        seen, reward, terminated, truncated, info = env.step(action)
        _, expected, *ends, _ = plain.step(np.concatenate([action["action"], action["prediction"]]))
        assert reward == pytest.approx(expected, abs=1e-5)
        assert [terminated, truncated] == ends
        np.testing.assert_array_equal(info["prediction"]["target"], target)
        assert info["base_reward"] == pytest.approx(-effort * np.square(action["action"]).mean(), abs=1e-4)
        info["prediction"]["target"] = env._target()
    said = torch.tensor(action["prediction"], requires_grad=True)
    loss = env.loss_fn.torch(said, torch.from_numpy(target))
    assert loss.item() == pytest.approx(env.loss_fn.numpy(action["prediction"], target), rel=1e-4)
    loss.backward()
    assert torch.isfinite(said.grad).all()
    assert said.grad.abs().max() > 0


def test_ap_gym_takes_it_as_its_own():
    env = ActivePerception(gymnasium.make(TASK))
    assert ap_gym.ensure_active_perception_env(env) is env
    assert env.inner_action_space.shape == (COMMANDS,)
    env = ap_gym.TimeLimit(env, 5) if hasattr(ap_gym, "TimeLimit") else env
    env.reset(seed=0)
    ends = [env.step(env.action_space.sample())[3] for _ in range(5)]
    assert ends == [False] * 4 + [True]
