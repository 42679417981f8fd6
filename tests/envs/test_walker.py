"""WalkerTracking: what is seen is what is there, and estimates are scored by it."""

import pytest

from motionenv.envs import WalkerTracking
from tests.envs.playing import begun


def test_neither_observation_nor_info_holds_the_truth():
    env, seen = begun(seed=0)
    assert set(seen) == {"rgb", "mask", "depth"}
    truth = env.truth()
    _, _, _, _, info = env.step(truth["pose"])
    assert set(info) == {"error", "lost"}


def test_unknown_arguments_are_named():
    with pytest.raises(TypeError, match="colour"):
        WalkerTracking(colour="red")
