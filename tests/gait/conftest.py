"""What several tests of gait share."""

import pytest

from motionenv.gait import analyse
from motionenv.models.synthesis import synthesize


@pytest.fixture(scope="session")
def people() -> dict:
    """Three people, the first with two captures."""
    trials = [analyse(synthesize("walk/fpca", seconds=4, fps=50, seed=seed)) for seed in range(4)]
    return {"a": trials[:2], "b": trials[2:3], "c": trials[3:]}
