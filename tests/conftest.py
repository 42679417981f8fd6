"""What the tests share: where the real motion capture is."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# The same examples in every run, and no deadline: the first call of a kernel compiles it.
settings.register_profile("motionenv", deadline=None, derandomize=True, database=None)
settings.load_profile("motionenv")

MOCAP = Path(os.environ.get("MOTIONENV_MOCAP", Path(__file__).parents[2] / "shared" / "mocap"))


@pytest.fixture(scope="session")
def mocap() -> Path:
    """Folder of real motion capture: beside the checkout in ../shared/mocap, or where MOTIONENV_MOCAP says."""
    if not MOCAP.is_dir():
        pytest.skip(f"no motion capture at {MOCAP}: set MOTIONENV_MOCAP to its folder")
    return MOCAP
