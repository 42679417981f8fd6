"""Train PPO (Schulman et al. 2017) to turn the camera of ActiveTracking, without memory or with a recurrent network.

    motionenv bench envs.active.ppo ppo --minutes 8 --out ppo.pt
    motionenv bench envs.active.ppo recurrent --minutes 8 --out recurrent.pt

Both leave the estimate to `Beliefs`, and learn the three commands of the camera on split "train". "ppo" sees a summary
of the beliefs, which remember for it; "recurrent" sees only detections and camera, and must remember by itself. They
decide every half second, as a camera with inertia averages away what is drawn anew in each frame.

Needs PyTorch: pip install torch --index-url https://download.pytorch.org/whl/cpu
"""

import time
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np

from benchmarks import Arguments, needs, scratch

needs("torch")
import torch

import motionenv.envs  # noqa: F401 (registers the environments)
from motionenv.envs.active import Still
from motionenv.envs.active.policies import PARTICLES

NAME = "motionenv/ActiveTracking-v1"
ENVS, REPEAT, EPOCHS, PARTS = 64, 5, 5, 4  # parallel episodes, frames of a decision, passes, minibatches
GAMMA, LAMBDA, CLIP, ENTROPY, RATE = 0.9, 0.95, 0.2, 1e-3, 1e-3  # of decisions: 0.98 per frame
HIDDEN, SECTORS = 96, 16
FEW = 64  # particles in training, for speed


class Network(torch.nn.Module):
    """Maps inputs (decisions, n, inputs) to means of commands (decisions, n, 3) and values (decisions, n)."""

    def __init__(self, inputs: int, recurrent: bool):
        super().__init__()
        self.first = torch.nn.Sequential(torch.nn.Linear(inputs, HIDDEN), torch.nn.Tanh())
        self.memory = torch.nn.GRU(HIDDEN, HIDDEN) if recurrent else None
        self.heads = torch.nn.ModuleList(
            torch.nn.Sequential(torch.nn.Linear(HIDDEN, HIDDEN), torch.nn.Tanh(), torch.nn.Linear(HIDDEN, size))
            for size in (3, 1)
        )
        self.spread = torch.nn.Parameter(torch.full((3,), -0.7))  # log standard deviation of commands
        with torch.no_grad():
            self.heads[0][-1].weight *= 0.05

    def forward(self, inputs: torch.Tensor, state: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Means, values, and the new state (1, n, HIDDEN)."""
        features = self.first(inputs)
        if self.memory is not None:
            features, state = self.memory(features, state)
        return self.heads[0](features), self.heads[1](features)[..., 0], state

    def law(self, means: torch.Tensor) -> torch.distributions.Normal:
        """Distribution of commands."""
        return torch.distributions.Normal(means, self.spread.exp())


class Learned(Still):
    """A network as a policy.

    Args:
        env: ActiveTracking, single or vector.
        seed: of particles and commands.
        network: trained or not; None makes one.
        recurrent: whether a new network has memory.
        particles: per person.
    """

    def __init__(
        self, env, seed: int = 0, network: Network | None = None, recurrent: bool = False, particles: int = PARTICLES
    ):
        super().__init__(env, seed, particles)
        k = self.scene.people
        self.network = network or Network(6 + 8 * k if recurrent else SECTORS + 6 + 6 * k, recurrent)
        self.recurrent = self.network.memory is not None
        n = env.unwrapped.world.n
        self.state, self.kept, self.age = torch.zeros(1, n, HIDDEN), np.zeros((n, 3)), np.zeros(n, np.intp)

    def reset(self, observation, began=None) -> None:
        """Forget ended episodes."""
        super().reset(observation, began)
        fresh = np.ones(len(self.age), bool) if began is None else np.asarray(began, bool)
        self.state[:, torch.from_numpy(fresh)] = 0.0
        self.age[fresh] = 0

    def sense(self, seen: dict[str, np.ndarray]) -> torch.Tensor:
        """The network's inputs (n, inputs)."""
        camera = np.concatenate([seen["camera"][:, 1:], seen["time_left"]], axis=-1)
        parts = _raw(seen) if self.recurrent else _summary(seen, self.beliefs)
        return torch.from_numpy(np.concatenate([camera, parts], axis=-1).astype(np.float32))

    def commands(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """As `Still.commands`."""
        due = self.age % REPEAT == 0
        if due.any():
            with torch.no_grad():
                means, _, state = self.network(self.sense(seen)[None], self.state)
            self.kept[due] = means[0].clamp(-1, 1).numpy()[due]
            self.state[:, torch.from_numpy(due)] = state[:, torch.from_numpy(due)]
        self.age += 1
        return self.kept


def _raw(seen: dict[str, np.ndarray]) -> np.ndarray:
    """Detections and roster (n, 8 people)."""
    count = seen["seen"].sum(axis=-1)
    middle = (seen["points"] * seen["seen"][..., None]).sum(axis=-2) / np.maximum(count, 1)[..., None]
    rows = np.concatenate([middle, seen["colours"], count[..., None] / 15, seen["roster"]], axis=-1)
    return rows.reshape(len(rows), -1)


def _summary(seen: dict[str, np.ndarray], beliefs) -> np.ndarray:
    """Beliefs relative to the camera (n, SECTORS + 6 people): people from the least to the most certain."""
    places, pan = beliefs.particles[..., :2], seen["camera"][:, 0]
    ways = np.arctan2(places[..., 1], places[..., 0]) - pan[:, None, None]
    bins = (ways / (2 * np.pi) * SECTORS).round().astype(int) % SECTORS
    shares = np.stack([(bins == s).mean(axis=-1) for s in range(SECTORS)], axis=-1)
    doubt = (beliefs.sigmas[..., None] * shares).mean(axis=1)  # [m] by direction
    mean = places.mean(axis=2)
    far, way = np.linalg.norm(mean, axis=-1), np.arctan2(mean[..., 1], mean[..., 0]) - pan[:, None]
    rows = np.stack([np.sin(way), np.cos(way), (way + np.pi) % (2 * np.pi) / np.pi - 1, far / 10,
                     np.log(beliefs.sigmas + 0.05), beliefs.seen], axis=-1)  # fmt: skip
    order = np.argsort(-beliefs.sigmas, axis=-1)
    return np.concatenate([doubt, np.take_along_axis(rows, order[..., None], axis=1).reshape(len(rows), -1)], axis=-1)


class Trainer:
    """Collects episodes of some squares and improves the network.

    Args:
        recurrent: whether the network has memory.
        seed: of episodes, weights and commands.
        envs: number of squares.
    """

    def __init__(self, recurrent: bool, seed: int, envs: int):
        self.envs = envs
        torch.manual_seed(seed)
        self.env = gymnasium.make_vec(NAME, num_envs=envs, split="train", autoreset_mode="Disabled")
        self.agent = Learned(self.env, seed, recurrent=recurrent, particles=FEW)
        self.network = self.agent.network
        self.optimiser = torch.optim.Adam(self.network.parameters(), lr=RATE)
        self.frames = 0
        self.env.reset(seed=seed)

    def episodes(self) -> dict[str, torch.Tensor]:
        """Play an episode in each environment; returns arrays (decisions, n, ...)."""
        agent, rows, over = self.agent, [], False
        observation, _ = self.env.reset()
        agent.reset(observation)
        while not over:
            agent.beliefs.update(observation)
            inputs, gained = agent.sense(agent.beliefs.batched(observation)), np.zeros(self.envs)
            with torch.no_grad():
                means, values, agent.state = self.network(inputs[None], agent.state)
                law = self.network.law(means[0])
                drawn = law.sample()
            for frame in range(REPEAT):
                if frame:
                    agent.beliefs.update(observation)
                action = agent.beliefs.action(drawn.clamp(-1, 1).numpy())
                observation, rewards, _, truncated, _ = self.env.step(action)
                gained += rewards / REPEAT
                over = truncated.all()
                self.frames += self.envs
            rows.append((inputs, drawn, law.log_prob(drawn).sum(-1), values[0], torch.from_numpy(gained).float()))
        names = "inputs", "drawn", "logs", "values", "rewards"
        return dict(zip(names, map(torch.stack, zip(*rows, strict=True)), strict=True))

    def improve(self, data: dict[str, torch.Tensor]) -> None:
        """PPO's update."""
        values = torch.cat([data["values"], torch.zeros(1, self.envs)])  # time is an input: nothing comes after the end
        advantage, gains = torch.zeros(self.envs), []
        for t in range(len(data["rewards"]) - 1, -1, -1):
            surprise = data["rewards"][t] + GAMMA * values[t + 1] - values[t]
            advantage = surprise + GAMMA * LAMBDA * advantage
            gains.append(advantage)
        gain = torch.stack(gains[::-1])
        aims, gain = gain + data["values"], (gain - gain.mean()) / (gain.std() + 1e-6)
        for _ in range(EPOCHS):
            for part in torch.randperm(self.envs).chunk(PARTS):
                means, value, _ = self.network(data["inputs"][:, part], torch.zeros(1, len(part), HIDDEN))
                law = self.network.law(means)
                ratio = (law.log_prob(data["drawn"][:, part]).sum(-1) - data["logs"][:, part]).exp()
                better = torch.min(ratio * gain[:, part], ratio.clamp(1 - CLIP, 1 + CLIP) * gain[:, part]).mean()
                off = (value - aims[:, part]).square().mean()
                loss = 0.05 * off - better - ENTROPY * law.entropy().sum(-1).mean()
                self.optimiser.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_(self.network.parameters(), 0.5)
                self.optimiser.step()


def train(recurrent: bool, minutes: float, path: Path, seed: int = 0, envs: int = ENVS) -> None:
    """Train a network for so many minutes of processor time, and write it to a file."""
    trainer, returns, shown = Trainer(recurrent, seed, envs), [], 0.0
    trainer.improve(trainer.episodes())  # compiles the kernels, outside of the clock
    began = time.process_time()
    while (spent := (time.process_time() - began) / 60) < minutes:
        for group in trainer.optimiser.param_groups:
            group["lr"] = RATE * (1 - spent / minutes) + 1e-5
        data = trainer.episodes()
        trainer.improve(data)
        returns.append(float(data["rewards"].mean()))
        if spent >= shown:
            shown += minutes / 16
            print(f"  {spent:4.1f} min, {trainer.frames:9,} frames: {np.mean(returns[-4:]):.3f} per frame", flush=True)
    weights = trainer.network.state_dict()
    torch.save({"recurrent": recurrent, "weights": weights}, path)


def policy(path: Path | str) -> partial:
    """A policy from a file of `train`, to be called with an environment and a seed."""
    stored = torch.load(path, weights_only=True)
    network = Network(stored["weights"]["first.0.weight"].shape[1], stored["recurrent"])
    network.load_state_dict(stored["weights"])
    return partial(Learned, network=network)


def main() -> None:
    """Train, and write the weights."""
    parser = Arguments(__doc__)
    parser.add_argument("kind", choices=("ppo", "recurrent"), nargs="?", default="ppo")
    parser.add_argument("--minutes", type=float, default=8.0, quick=1e-6, help="of processor time")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True, quick=scratch() / "weights.pt", help="file for the weights")
    asked = parser.parse_args()
    torch.set_num_threads(1)
    for kind in ("ppo", "recurrent") if asked.quick else (asked.kind,):
        train(kind == "recurrent", asked.minutes, asked.out, asked.seed, 4 if asked.quick else ENVS)


if __name__ == "__main__":
    main()
