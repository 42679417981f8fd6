"""Estimates become actions of every environment's own space, that say what was meant."""

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.envs.agents.action_adapter import Actions
from motionenv.envs.arm import ArmTracking, ArmTrackingVector
from motionenv.envs.markers import MarkerTracking, MarkerTrackingVector
from motionenv.envs.walker import WalkerTracking, WalkerTrackingVector
from motionenv.types import MARKERS

PAIRS = {"walker": (WalkerTracking, WalkerTrackingVector), "arm": (ArmTracking, ArmTrackingVector)}
ELBOW_AND_WRIST = [MARKERS.index("right_elbow"), MARKERS.index("right_wrist")]


def estimate(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Poses (1, samples, 25) and their joints."""
    poses = np.random.default_rng(0).normal(0, 0.3, (1, samples, 25))
    return poses, markers(poses[0], from_height())[None]


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("form", ["pose", "joints", "belief"])
def test_an_action_is_in_the_space_and_says_the_estimate(kind, form):
    for make, many in zip(PAIRS[kind], ((), (3,)), strict=True):
        env = make(*many, size=36, horizon=3, estimate=form, n_belief=4, actions="metric")
        actions = Actions(env)
        assert (actions.form, actions.arm, actions.samples) == (form, kind == "arm", 4 if form == "belief" else 1)
        poses, joints = estimate(actions.samples)
        action = actions.of(poses, joints)
        assert env.action_space.contains(action)
        said = action.reshape(-1, *action.shape[-2:] if form != "pose" else action.shape[-1:])
        entries = RIGHT_ARM if kind == "arm" else range(25)
        rows = ELBOW_AND_WRIST if kind == "arm" else range(15)
        meant = {"pose": poses[0, 0, list(entries)], "joints": joints[0, 0, list(rows)],
                 "belief": np.column_stack([poses[0][:, list(entries)], np.zeros(actions.samples)])}[form]  # fmt: skip
        assert len(said) == actions.n == (many or (1,))[0]
        for one in said:
            np.testing.assert_allclose(one, meant, rtol=1e-6)


def test_what_is_out_of_bounds_goes_to_the_bound():
    env = MarkerTracking(horizon=3)
    joints = np.full((1, 1, 15, 3), 1e9)
    action = Actions(env).of(None, joints)
    assert env.action_space.contains(action)
    np.testing.assert_array_equal(action, env.action_space.high)


@pytest.mark.parametrize("observation", ["rgb", "mask", "depth", ("mask", "depth")])
def test_observations_are_called_by_what_they_show(observation):
    names = [observation] if isinstance(observation, str) else list(observation)
    for make, many in ((WalkerTracking, ()), (WalkerTrackingVector, (3,))):
        env = make(*many, size=36, horizon=3, observation=observation)
        actions = Actions(env)
        seen = actions.batched(env.reset(seed=0)[0])
        assert sorted(seen) == sorted(names)
        assert {len(picture) for picture in seen.values()} == {actions.n}
        if "depth" in names:
            background = seen["depth"].max()
            assert actions.far == background
    assert Actions(MarkerTrackingVector(2, horizon=3)).points
