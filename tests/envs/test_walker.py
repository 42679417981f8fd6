"""WalkerTracking: what is seen is what is there, and estimates are scored by it."""

import numpy as np
import pytest

from motionenv.envs import WalkerTracking
from motionenv.errors import MotionError
from tests.envs.playing import begun


def test_neither_observation_nor_info_holds_the_truth():
    env, seen = begun(seed=0)
    assert set(seen) == {"rgb", "mask", "depth"}
    truth = env.truth()
    _, _, _, _, info = env.step(truth["pose"])
    assert set(info) == {"error", "lost"}


def headings(**arguments) -> np.ndarray:
    """(episodes, frames) [rad]."""
    env, found = WalkerTracking(size=36, start="line", actions="metric", **arguments), []
    for seed in range(6):
        env.reset(seed=seed)
        found.append([])
        for _ in range(90):
            found[-1].append(env.truth()["pose"][5])
            env.step(np.zeros(25))
    return np.array(found)


def test_on_a_turning_path_walkers_turn():
    straight, turning = headings(), headings(path="turning")
    assert np.ptp(straight, axis=1).max() < 0.5
    assert np.mean(np.ptp(turning, axis=1)) > 0.6
    assert (np.sign(turning[:, -1] - turning[:, 0]) > 0).any()  # some left
    assert (np.sign(turning[:, -1] - turning[:, 0]) < 0).any()  # and some right
    with pytest.raises(MotionError, match="path must be one of straight, turning, got 'round'"):
        WalkerTracking(path="round")
