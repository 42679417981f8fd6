"""Small networks that estimate joints from observations, with and without memory.

The memoryless network sees the last observation only. The recurrent one sees the same, and remembers with a GRU; of
colour images it also remembers each pixel's mean, from which what moves stands out. The size is what learned best on
split "train" of MarkerTracking-Easy.
"""

import numpy as np
import torch
from torch import nn

from benchmarks.envs.tasks.features import UNITS, JointFeatures, PictureFeatures, PointFeatures

SCORED = {15: list(range(15)), 2: [6, 8]}  # joints that are asked for, by their number: all, or elbow and wrist

#: What is remembered: by the GRU (1, n, UNITS), and by features (n, ...); None is nothing.
State = tuple[torch.Tensor | None, torch.Tensor | None] | None


class Network(nn.Module):
    """Maps observations (frames, n, ...) to joints (frames, n, joints, 3) [m].

    Args:
        env: the environments.
        remembers: whether it has a GRU.
    """

    def __init__(self, env, remembers: bool):
        super().__init__()
        self.joints, space = env.single_action_space.shape[0], env.single_observation_space
        self.points, self.shown = hasattr(space, "spaces"), not hasattr(space, "spaces") and len(space.shape) == 2
        self.features: nn.Module
        if self.points:
            self.features = PointFeatures()
        elif self.shown:
            self.features = JointFeatures(SCORED[self.joints])
        else:
            self.features = PictureFeatures(space.shape[-1] == 3, remembers)
        size = self.features.size
        self.memory = nn.GRU(size, UNITS) if remembers else None
        self.last = nn.Sequential(
            nn.Linear(size + UNITS if remembers else size, UNITS), nn.ReLU(), nn.Linear(UNITS, 3 * self.joints)
        )

    def forward(self, seen: torch.Tensor, state: State) -> tuple[torch.Tensor, State]:
        """Joints, and the new state."""
        remembered, kept = state or (None, None)
        features, guess, kept = self.features(seen, kept)
        if self.memory is not None:
            past, remembered = self.memory(features, remembered)
            features = torch.cat([features, past], dim=-1)
        corrections = self.last(features).unflatten(-1, (self.joints, 3))
        return guess + self.features.scale * corrections, (remembered, kept)

    def inputs(self, observation) -> torch.Tensor:
        """A vector environment's observation as `forward` takes it, without the axis of frames."""
        if self.shown:
            return torch.from_numpy(observation.reshape(len(observation), 45))
        if not self.points:
            return torch.from_numpy(np.ascontiguousarray(np.moveaxis(observation, -1, 1)))
        points = observation["points"].reshape(len(observation["points"]), 30)
        return torch.from_numpy(np.concatenate([points, observation["seen"].astype(np.float32)], axis=-1))


class Learned:
    """A network as an agent.

    Args:
        env: vector environment.
        network: trained for it.
    """

    def __init__(self, env, network: Network):
        self.env, self.network = env.unwrapped, network
        self.state: State = None

    def reset(self, observation, began=None) -> None:
        """Forget ended episodes."""
        if began is None or np.all(began) or self.state is None:
            self.state = None
            return
        began, (remembered, kept) = torch.from_numpy(np.asarray(began, bool)), self.state
        if remembered is not None:
            remembered[:, began] = 0.0
        fresh = self.network.features.blank(len(began))
        if kept is not None and fresh is not None:
            kept[began] = fresh[began]

    def act(self, observation) -> np.ndarray:
        """Estimate the joints."""
        with torch.no_grad():
            joints, self.state = self.network(self.network.inputs(observation)[None], self.state)
        return self.env.action(joints[0].numpy())
