"""What the renderers' tests share: bodies to draw."""

import numpy as np
import pytest


def _walking(n: int, seed: int = 0, height: float = 1.75) -> np.ndarray:
    rng = np.random.default_rng(seed)
    poses = np.zeros((n, 25))
    poses[:, 2] = 0.53 * height
    poses[:, 5] = rng.uniform(-np.pi, np.pi, n)
    poses[:, 6:] = rng.normal(size=(n, 19)) * 0.3
    poses[:, [12, 16, 20, 24]] = np.abs(poses[:, [12, 16, 20, 24]])
    return poses


@pytest.fixture(scope="session")
def walking():
    """Makes poses (n, 25) of somebody who stands about the origin and moves the limbs at random."""
    return _walking
