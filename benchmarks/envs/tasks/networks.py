"""Small networks that estimate joints from observations, with and without memory.

The memoryless network sees the last observation only. The recurrent one sees the same, and remembers with a GRU. Sizes
are those that learned best on split "train" of MarkerTracking-Easy (`motionenv bench envs.learning`).
"""

import numpy as np
import torch
from torch import nn

UNITS = 192
_NOWHERE = 0.9  # [m] height of a marker that isn't seen


class PointFeatures(nn.Module):
    """Markers (..., 45): positions of those that are seen, and which are."""

    def __init__(self):
        super().__init__()
        self.first = nn.Linear(45, UNITS)

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        """Features (..., UNITS)."""
        return torch.relu(self.first(seen))


class PictureFeatures(nn.Module):
    """Pictures (..., channels, 64, 64) from 0 to 255."""

    def __init__(self, channels: int):
        super().__init__()
        layers: list[nn.Module] = []
        for before, after in ((channels, 16), (16, 32), (32, 32), (32, 48)):
            layers += [nn.Conv2d(before, after, 3, stride=2, padding=1), nn.ReLU()]
        self.look = nn.Sequential(*layers, nn.Flatten(), nn.Linear(48 * 16, UNITS), nn.ReLU())

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        """Features (..., UNITS)."""
        return self.look(seen.flatten(0, -4).float() / 255).unflatten(0, seen.shape[:-3])


class Network(nn.Module):
    """Maps observations (frames, n, ...) to joints (frames, n, joints, 3) [m].

    Args:
        env: the environments.
        remembers: whether it has a GRU.
    """

    def __init__(self, env, remembers: bool):
        super().__init__()
        self.joints, self.remembers = env.single_action_space.shape[0], remembers
        self.points = hasattr(env.single_observation_space, "spaces")
        channels = 1 if self.points else env.single_observation_space.shape[-1]
        self.features = PointFeatures() if self.points else PictureFeatures(channels)
        self.memory = nn.GRU(UNITS, UNITS) if remembers else None
        self.last = nn.Sequential(
            nn.Linear(2 * UNITS if remembers else UNITS, UNITS), nn.ReLU(), nn.Linear(UNITS, 3 * self.joints)
        )

    def forward(self, seen: torch.Tensor, state: torch.Tensor | None) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Joints, and the new state (1, n, UNITS) of the memory."""
        features = self.features(seen)
        if self.memory is not None:
            remembered, state = self.memory(features, state)
            features = torch.cat([features, remembered], dim=-1)
        joints = self.last(features).unflatten(-1, (self.joints, 3))
        if self.points:  # what is seen is corrected, what isn't is guessed
            points, shown = seen[..., :30].unflatten(-1, (15, 2)), seen[..., 30:]
            high = torch.where(shown > 0, points[..., 1], _NOWHERE)
            joints = joints + torch.stack([points[..., 0], torch.zeros_like(high), high], dim=-1)
        else:
            joints = 2.0 * joints + torch.tensor([0.0, 0.0, _NOWHERE])
        return joints, state

    def inputs(self, observation) -> torch.Tensor:
        """A vector environment's observation as `forward` takes it, without the axis of frames."""
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
        self.state = torch.zeros(1, env.num_envs, UNITS)

    def reset(self, observation, began=None) -> None:
        """Forget ended episodes."""
        began = np.ones(self.state.shape[1], bool) if began is None else np.asarray(began, bool)
        self.state[:, torch.from_numpy(began)] = 0.0

    def act(self, observation) -> np.ndarray:
        """Estimate the joints."""
        with torch.no_grad():
            joints, state = self.network(self.network.inputs(observation)[None], self.state)
        self.state = self.state if state is None else state
        return self.env.action(joints[0].numpy())
