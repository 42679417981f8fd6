"""Motions whose nodes a known body made."""

import numpy as np
import pytest

from motionenv import body
from motionenv.body.skeleton import SEGMENTS
from motionenv.types import POSE

HINGES = [i for i, name in enumerate(POSE) if "knee" in name or "elbow" in name]


@pytest.fixture(scope="session")
def smooth_motion():
    """Makes poses (frames, 25) from a seed: swings within the joints' ranges, knees and elbows bent by 23° at least."""

    def make(seed, frames=240, fps=100.0):
        rng = np.random.default_rng(seed)
        time = np.arange(frames)[:, None] / fps
        poses = rng.normal(0, 0.3, 25) * np.sin(2 * np.pi * (time * rng.uniform(0.4, 1, 25) + rng.uniform(0, 1, 25)))
        poses[:, HINGES] = np.abs(poses[:, HINGES]) + 0.4
        poses[:, 5] += np.linspace(0, 8, frames)  # turns more than once around
        return poses

    return make


@pytest.fixture(scope="session")
def nodes_of():
    """Makes nodes (frames, 16, 3), directions to the left of the head, and rotations of the torso from poses."""

    def make(poses, skeleton):
        nodes, rotations = body.forward(poses, skeleton)
        return nodes, rotations[:, SEGMENTS.index("head"), :, 1], rotations[:, SEGMENTS.index("torso")]

    return make
