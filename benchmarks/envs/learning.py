"""Train a small recurrent network on MarkerTracking, and compare it with agents that don't learn.

Run: python -m benchmarks.envs.learning [--minutes 6] [--plot curve.png]

The network learns by imitation: observations of new episodes of split "train" are the inputs, and `truth()` gives the
targets. (Policy gradients on the reward, which is minus this loss, would work too, but slowly.) Actions don't influence
observations, so they don't matter in these episodes. Evaluation uses complete episodes of split "eval", with other
walkers and without `truth()`.

Needs PyTorch: pip install torch --index-url https://download.pytorch.org/whl/cpu
"""

import argparse
import time

import gymnasium
import numpy as np
import torch

import motionenv.envs  # noqa: F401 (registers the environments)
from motionenv.envs.agents.baselines import ConstantVelocity, MeanPose
from motionenv.envs.agents.evaluation import evaluate

NAME = "motionenv/MarkerTracking-v1"
ENVS, HIDDEN, CHUNK = 128, 192, 40  # parallel episodes, units, frames between updates
RATE = 3e-3
EPISODES = 512  # of each final evaluation
INPUTS = 15 * 4  # last seen position, visibility and time since last seen of each marker


class Memory:
    """Last seen position of each marker, and the time since then."""

    def __init__(self, n: int):
        self.points = np.zeros((n, 15, 2), np.float32)
        self.age = np.ones((n, 15), np.float32)
        self.forget(np.ones(n, bool))

    def forget(self, began: np.ndarray) -> None:
        """Reset the memory where episodes `began`."""
        self.points[began] = 0.0, 0.9
        self.age[began] = 1.0

    def of(self, observation: dict) -> np.ndarray:
        """The network's input (n, 60)."""
        seen = observation["seen"] > 0
        self.points[seen] = observation["points"][seen]
        self.age = np.where(seen, 0.0, np.minimum(self.age + 0.05, 1.0)).astype(np.float32)
        parts = self.points.reshape(len(seen), 30), seen.astype(np.float32), self.age
        return np.concatenate(parts, axis=-1)


class Network(torch.nn.Module):
    """Maps inputs (frames, n, 60) to joints (frames, n, 15, 3): corrected last seen positions, and depth."""

    def __init__(self):
        super().__init__()
        self.first = torch.nn.Linear(INPUTS, HIDDEN)
        self.memory = torch.nn.GRU(HIDDEN, HIDDEN)
        self.last = torch.nn.Sequential(
            torch.nn.Linear(2 * HIDDEN, HIDDEN), torch.nn.ReLU(), torch.nn.Linear(HIDDEN, 45)
        )

    def forward(self, inputs: torch.Tensor, state: torch.Tensor | None) -> tuple[torch.Tensor, torch.Tensor]:
        """Estimates, and the new state (1, n, HIDDEN)."""
        features = torch.relu(self.first(inputs))
        remembered, state = self.memory(features, state)
        joints = self.last(torch.cat([features, remembered], dim=-1)).unflatten(-1, (15, 3))
        points = inputs[..., :30].unflatten(-1, (15, 2))
        flat = torch.stack([points[..., 0], torch.zeros_like(points[..., 0]), points[..., 1]], dim=-1)
        return flat + joints, state


class Learned:
    """The network as an agent."""

    def __init__(self, network: Network, env):
        self.env, self.network, self.memory = env.unwrapped, network, Memory(env.num_envs)
        self.state = torch.zeros(1, env.num_envs, HIDDEN)

    def reset(self, observation, began=None) -> None:
        """Forget the episodes that have ended."""
        began = np.ones(self.state.shape[1], bool) if began is None else np.asarray(began, bool)
        self.memory.forget(began)
        self.state[:, torch.from_numpy(began)] = 0.0

    def act(self, observation) -> np.ndarray:
        """Estimate the joints."""
        with torch.no_grad():
            joints, self.state = self.network(torch.from_numpy(self.memory.of(observation))[None], self.state)
        return self.env.action(joints[0].numpy())


class LastSeen:
    """Baseline: each marker's last seen position, at the walker's mean depth."""

    def __init__(self, env):
        self.env, self.memory = env.unwrapped, Memory(env.num_envs)

    def reset(self, observation, began=None) -> None:
        """Forget the episodes that have ended."""
        self.memory.forget(np.ones(len(self.memory.age), bool) if began is None else np.asarray(began, bool))

    def act(self, observation) -> np.ndarray:
        """Estimate the joints."""
        self.memory.of(observation)
        return self.env.action(np.insert(self.memory.points, 1, 0.0, axis=-1))


def watched(env, memory: Memory) -> tuple[torch.Tensor, torch.Tensor]:
    """Inputs (frames, n, 60) and truths (frames, n, 15, 3) of one episode of each environment."""
    observation, _ = env.reset()
    memory.forget(np.ones(env.num_envs, bool))
    nothing = np.zeros(env.action_space.shape, np.float32)
    inputs, truths, over = [], [], False
    while not over:
        inputs.append(memory.of(observation))
        truths.append([truth["joints"] for truth in env.unwrapped.truth()])
        observation, _, _, truncated, _ = env.step(nothing)
        over = truncated.all()
    return torch.from_numpy(np.stack(inputs)), torch.from_numpy(np.array(truths, np.float32))


def learn(network: Network, seconds: float, evaluate) -> list[tuple[float, int, float]]:
    """Train for `seconds`; return (seconds, frames, error [m] on split "eval") at intervals."""
    env = gymnasium.make_vec(NAME, num_envs=ENVS, split="train", autoreset_mode="Disabled")
    env.reset(seed=0)
    optimiser = torch.optim.Adam(network.parameters(), lr=RATE)
    memory, frames, spent, curve = Memory(ENVS), 0, 0.0, [(0.0, 0, evaluate())]
    while spent < seconds:
        start = time.perf_counter()
        for group in optimiser.param_groups:
            group["lr"] = RATE * 0.5 * (1 + np.cos(np.pi * spent / seconds)) + 1e-5
        inputs, truths = watched(env, memory)
        state = None
        for first in range(0, len(inputs), CHUNK):
            joints, state = network(inputs[first : first + CHUNK], state)
            loss = torch.linalg.norm(joints - truths[first : first + CHUNK], dim=-1).mean()
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            state = state.detach()
        frames += inputs.shape[0] * ENVS
        spent += time.perf_counter() - start
        if spent >= curve[-1][0] + seconds / 12 or spent >= seconds:
            curve.append((spent, frames, evaluate()))
            print(f"  {spent:5.0f} s, {frames:9,} frames: {1000 * curve[-1][2]:.1f} mm", flush=True)
    return curve


def plot(path: str, curve, others: dict[str, float]) -> None:
    """Plot the error over time, with the agents that don't learn as lines."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
    for (name, error), style in zip(others.items(), (":", "--", "-."), strict=True):
        axes.axhline(1000 * error, color="0.4", ls=style, label=name)
    axes.plot([s / 60 for s, _, _ in curve], [1000 * error for _, _, error in curve], "o-", label="recurrent network")
    axes.set(xlabel="minutes of training, one thread", ylabel="error per joint [mm]", title=NAME)
    axes.set_ylim(bottom=0)
    axes.legend()
    figure.savefig(path, dpi=120)


def main() -> None:
    """Train, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=6.0, help="of training")
    parser.add_argument("--plot", help="file for the curve")
    arguments = parser.parse_args()
    torch.manual_seed(0)
    torch.set_num_threads(1)  # matrices are too small for a second thread
    env = gymnasium.make_vec(NAME, num_envs=64, split="eval")
    network = Network()
    quick = lambda: float(evaluate(env, Learned(network, env), 64, seed=1).errors.mean())
    curve = learn(network, 60 * arguments.minutes, quick)
    agents = {"mean pose": MeanPose(env), "last seen": LastSeen(env), "constant velocity": ConstantVelocity(env)}
    agents["recurrent network"] = Learned(network, env)
    errors = {name: evaluate(env, agent, EPISODES, seed=2).errors for name, agent in agents.items()}
    mine = errors["recurrent network"].mean()
    print(
        "\n| agent | error per joint [mm], mean over episodes | 5th to 95th percentile of episodes "
        "| relative to the network |\n|-|-|-|-|"
    )
    for name, error in errors.items():
        low, high = np.percentile(1000 * error, [5, 95])
        print(f"| {name} | {1000 * error.mean():.1f} | {low:.0f}–{high:.0f} | {error.mean() / mine:.1f}× |")
    seconds, frames, _ = curve[-1]
    print(f"\n{frames:,} frames of split train in {seconds / 60:.1f} min; {EPISODES} episodes of split eval.")
    if arguments.plot:
        plot(arguments.plot, curve, {name: e.mean() for name, e in errors.items() if name != "recurrent network"})


if __name__ == "__main__":
    main()
