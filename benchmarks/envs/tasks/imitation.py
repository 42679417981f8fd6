"""Train a network for a task by imitation, on episodes of split "train".

Observations are the inputs, `truth()` gives the targets, and the loss is what the environment charges. Actions never
change what is seen, so those of these episodes don't matter. An agent that is evaluated has no `truth()`.
"""

import gymnasium
import numpy as np
import torch

from benchmarks.envs.tasks.networks import SCORED, Network
from motionenv.envs.simulation.picture_world import PictureWorld

RATE, LEAST = 3e-3, 1e-5  # learning rate at first and at last, as a cosine over the frames
CHUNK = 30  # frames between updates


def watched(env, network: Network, scored) -> tuple[torch.Tensor, torch.Tensor]:
    """Inputs (frames, n, ...) and true joints (frames, n, joints, 3) of an episode of each environment."""
    observation, _ = env.reset()
    nothing = np.zeros(env.action_space.shape, np.float32)
    inputs, truths, over = [], [], False
    while not over:
        inputs.append(network.inputs(observation))
        truths.append(true_joints(env)[:, scored])
        observation, _, _, truncated, _ = env.step(nothing)
        over = truncated.all()
    return torch.stack(inputs), torch.from_numpy(np.array(truths, np.float32))


def true_joints(env) -> np.ndarray:
    """True joints (n, 15, 3) [m], as of `truth()`; of images all at once, as `truth()` takes as long as a step."""
    world = env.unwrapped.world
    if not isinstance(world, PictureWorld):
        return np.array([truth["joints"] for truth in env.unwrapped.truth()])
    return world.stage.joints(np.arange(world.n))


def improve(network: Network, optimiser: torch.optim.Optimizer, inputs: torch.Tensor, truths: torch.Tensor) -> float:
    """Learn from what `watched` returned, some frames at a time; returns the last ones' mean error [m]."""
    state = None
    for first in range(0, len(inputs), CHUNK):
        joints, state = network(inputs[first : first + CHUNK], state)
        loss = torch.linalg.norm(joints - truths[first : first + CHUNK], dim=-1).mean()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        state = tuple(None if part is None else part.detach() for part in state)
    return loss.item()


def slow_down(optimiser: torch.optim.Optimizer, done: float) -> None:
    """Lower the learning rate as a cosine of the share of the frames that is `done`."""
    for group in optimiser.param_groups:
        group["lr"] = RATE * 0.5 * (1 + np.cos(np.pi * done)) + LEAST


def imitate(task: str, remembers: bool, frames: int, seed: int = 0) -> Network:
    """A network that has learned from so many frames, rounded up to whole episodes.

    Args:
        task: an id.
        remembers: whether it is recurrent.
        frames: of split "train", of all environments together.
        seed: of the network and the episodes.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    n = 128 if "Marker" in task else 32
    env = gymnasium.make_vec(task, num_envs=n, split="train", autoreset_mode="Disabled")
    env.reset(seed=seed)
    network = Network(env, remembers)
    scored = SCORED[network.joints]
    optimiser = torch.optim.Adam(network.parameters(), lr=RATE)
    seen, shown = 0, 0.0
    while (done := seen / frames) < 1.0:
        slow_down(optimiser, done)
        inputs, truths = watched(env, network, scored)
        loss = improve(network, optimiser, inputs, truths)
        seen += inputs.shape[0] * n
        if done >= shown:
            print(f"  {task} {seen:9,} frames: {1000 * loss:.0f} mm", flush=True)
            shown += 0.25
    env.close()
    return network.eval()
