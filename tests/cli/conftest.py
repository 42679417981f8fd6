"""What the tests of the commands share."""

from pathlib import Path

import pytest

import motionenv


@pytest.fixture(scope="module")
def walk(tmp_path_factory) -> Path:
    """A short walk in our own format."""
    path = tmp_path_factory.mktemp("walk") / "walk.npz"
    motionenv.write(motionenv.load("walk/fpca").synthesize(0.4, 20, seed=0), path)
    return path
