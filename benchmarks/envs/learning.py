"""Train a small recurrent network on MarkerTracking, and compare it with agents that don't learn.

    motionenv bench envs.learning [--minutes 6] [--plot curve.png]

The network learns by imitation: observations of new episodes of split "train" are the inputs, and `truth()` gives the
targets. (Policy gradients on the reward, which is minus this loss, would work too, but slowly.) Actions don't influence
observations, so they don't matter in these episodes. Evaluation uses complete episodes of split "eval", with other
walkers and without `truth()`.

Needs PyTorch: pip install torch --index-url https://download.pytorch.org/whl/cpu
"""

import time
from pathlib import Path

import gymnasium
import numpy as np

from benchmarks import Arguments, needs, scratch

needs("torch")
import torch

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks.envs.tasks.imitation import RATE, improve, slow_down, watched
from benchmarks.envs.tasks.networks import Learned, Network
from motionenv.envs.agents.baselines import Kalman, MeanPose
from motionenv.envs.agents.evaluation import evaluate

NAME = "motionenv/MarkerTracking-v1"
EPISODES = 512  # of each final evaluation


class LastSeen:
    """Baseline: each marker's last seen position, at the walker's mean depth."""

    def __init__(self, env):
        self.env, self.points = env.unwrapped, np.zeros((env.num_envs, 15, 2), np.float32)

    def reset(self, observation, began=None) -> None:
        """Forget the episodes that have ended."""
        self.points[slice(None) if began is None else began] = 0.0, 0.9

    def act(self, observation) -> np.ndarray:
        """Estimate the joints."""
        seen = observation["seen"] > 0
        self.points[seen] = observation["points"][seen]
        return self.env.action(np.insert(self.points, 1, 0.0, axis=-1))


def learn(network: Network, seconds: float, envs: int, evaluate) -> list[tuple[float, int, float]]:
    """Train for `seconds`; return (seconds, frames, error [m] on split "eval") at intervals."""
    env = gymnasium.make_vec(NAME, num_envs=envs, split="train", autoreset_mode="Disabled")
    env.reset(seed=0)
    optimiser = torch.optim.Adam(network.parameters(), lr=RATE)
    frames, spent, curve = 0, 0.0, [(0.0, 0, evaluate())]
    while spent < seconds:
        start = time.perf_counter()
        slow_down(optimiser, spent / seconds)
        improve(network, optimiser, *watched(env, network, slice(None)))
        frames += env.unwrapped.world.horizon * envs
        spent += time.perf_counter() - start
        if spent >= curve[-1][0] + seconds / 12 or spent >= seconds:
            curve.append((spent, frames, evaluate()))
            print(f"  {spent:5.0f} s, {frames:9,} frames: {1000 * curve[-1][2]:.1f} mm", flush=True)
    return curve


def plot(path: Path, curve, others: dict[str, float]) -> None:
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
    parser = Arguments(__doc__)
    parser.add_argument("--minutes", type=float, default=6.0, quick=0.001, help="of training")
    parser.add_argument("--plot", type=Path, quick=scratch() / "curve.png", help="file for the curve")
    arguments = parser.parse_args()
    torch.manual_seed(0)
    torch.set_num_threads(1)  # matrices are too small for a second thread
    envs, episodes = (2, 2) if arguments.quick else (64, EPISODES)
    env = gymnasium.make_vec(NAME, num_envs=envs, split="eval")
    network = Network(env, remembers=True)
    error = lambda: float(evaluate(env, Learned(env, network), envs, seed=1).errors.mean())
    curve = learn(network, 60 * arguments.minutes, 2 * envs, error)
    agents = {"mean pose": MeanPose(env), "last seen": LastSeen(env), "Kalman filter": Kalman(env)}
    agents["recurrent network"] = Learned(env, network)
    errors = {name: evaluate(env, agent, episodes, seed=2).errors for name, agent in agents.items()}
    mine = errors["recurrent network"].mean()
    print(
        "\n| agent | error per joint [mm], mean over episodes | 5th to 95th percentile of episodes "
        "| relative to the network |\n|-|-|-|-|"
    )
    for name, error in errors.items():
        low, high = np.percentile(1000 * error, [5, 95])
        print(f"| {name} | {1000 * error.mean():.1f} | {low:.0f}–{high:.0f} | {error.mean() / mine:.1f}× |")
    seconds, frames, _ = curve[-1]
    print(f"\n{frames:,} frames of split train in {seconds / 60:.1f} min; {episodes} episodes of split eval.")
    if arguments.plot:
        plot(arguments.plot, curve, {name: e.mean() for name, e in errors.items() if name != "recurrent network"})


if __name__ == "__main__":
    main()
