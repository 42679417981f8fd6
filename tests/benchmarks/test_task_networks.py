"""Networks of the leaderboard: nothing leaks between episodes or from the future, and what moves stands out."""

import gymnasium
import numpy as np
import pytest

import motionenv.envs  # noqa: F401 (registers the tasks)

torch = pytest.importorskip("torch", reason="PyTorch is missing: pip install -e '.[agents]'")
from benchmarks.envs.tasks.features import SIZE, UNSURE, moved  # noqa: E402
from benchmarks.envs.tasks.networks import Learned, Network  # noqa: E402


@pytest.mark.parametrize("task", [
    "MarkerTracking-Easy-v1", "WalkerTracking-Easy-v1", "WalkerTracking-Hard-v2", "ArmTracking-Hard-Full-v2"
])  # fmt: skip
@pytest.mark.parametrize("remembers", [False, True])
def test_an_agent_sees_the_past_of_its_episode_only(task, remembers):
    torch.manual_seed(0)
    env = gymnasium.make_vec(f"motionenv/{task}", num_envs=3, autoreset_mode="Disabled")
    observation, _ = env.reset(seed=0)
    network, inputs, actions = Network(env, remembers).eval(), [], []
    agent = Learned(env, network)
    for _ in range(4):
        inputs.append(network.inputs(observation))
        actions.append(agent.act(observation))
        observation, *_ = env.step(actions[-1])
    with torch.no_grad():
        at_once, _ = network(torch.stack(inputs), None)
    for joints, action in zip(at_once, actions, strict=True):
        np.testing.assert_allclose(env.unwrapped.action(joints.numpy()), action, atol=1e-5)
    agent.reset(observation, np.array([True, False, True]))
    fresh = Learned(env, network).act(observation)
    differs = np.abs(agent.act(observation) - fresh).max(axis=(1, 2)) > 1e-5
    assert differs.tolist() == [False, remembers, False]


def test_what_moves_is_what_differs_from_the_mean_so_far():
    seen = torch.from_numpy(np.random.default_rng(0).integers(0, 256, (5, 2, 3, SIZE, SIZE), dtype=np.uint8))
    first, sums = moved(seen[:2], None)
    last, _ = moved(seen[2:], sums)
    frames = seen.numpy().astype(float)
    for t, found in enumerate(torch.cat([first, last])):
        off = np.abs(frames[t] - frames[: t + 1].mean(axis=0)).max(axis=1)
        np.testing.assert_allclose(found, np.clip(off / UNSURE - 1, 0, 1), atol=1e-4)
