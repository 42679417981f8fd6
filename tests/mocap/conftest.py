"""Motions to write: a real walk, and any pose at all."""

from collections.abc import Callable

import numpy as np
import pytest

from motionenv import mocap as capture
from motionenv.body import from_height
from motionenv.mocap.retargeting import retarget
from motionenv.types import Motion


@pytest.fixture(scope="session")
def walk(mocap) -> Motion:
    """CMU's trial 02_01 on the body: 343 frames at 120 per second."""
    return retarget(capture.read(mocap / "cmu_asfamc" / "02" / "02_01.amc", fps=120))


@pytest.fixture(scope="session")
def without() -> Callable[..., Motion]:
    """Makes a motion without some entries of the pose vector, as a capture of a part of the body is."""

    def make(motion: Motion, *entries: slice) -> Motion:
        poses = motion.poses.copy()
        for entry in entries:
            poses[:, entry] = np.nan
        return Motion(poses, motion.skeleton, motion.fps, motion.name)

    return make


@pytest.fixture(scope="session")
def any_motion():
    """Makes a motion out of a seed: unrelated poses, angles of up to several radians."""

    def make(seed: int, frames: int = 5, fps: float = 100.0) -> Motion:
        rng = np.random.default_rng(seed)
        skeleton = from_height(rng.uniform(1.3, 2.0), girth=rng.uniform(0.7, 1.5))
        return Motion(rng.normal(0, 1.0, (frames, 25)), skeleton, fps, f"seed {seed}")

    return make
