"""Constant velocity: moments in closed form, parts of the body, and what captured walks say of the noise."""

import numpy as np
import pytest

import motionenv
from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.errors import MotionError
from motionenv.mocap import read_motion
from motionenv.tracking import Start, VelocityPrior
from motionenv.tracking.priors.velocity import CHANGE, VELOCITY, velocity_change
from motionenv.types import Motion

POSE, BEFORE = np.linspace(-0.5, 0.5, 25), np.linspace(-0.52, 0.5, 25)


def test_positions_go_on_and_spread_as_the_sum_of_the_noise():
    prior, rng = VelocityPrior(fps=25), np.random.default_rng(0)
    state = prior.initial(Start.at(POSE, BEFORE, spread=0.0), 20_000, rng)
    for _ in range(4):
        state = prior.propagate(state, rng)
    np.testing.assert_allclose(state.poses.mean(0), POSE + 4 * (POSE - BEFORE), atol=0.01)
    # The velocity at the start is uncertain by one step's noise too; then step k's noise counts 5 - k times.
    wanted = CHANGE * np.sqrt(30 / 25) / 25 * np.sqrt(4**2 + 4**2 + 3**2 + 2**2 + 1)
    np.testing.assert_allclose(state.poses.std(0), wanted, rtol=0.04)


def test_an_unknown_velocity_is_drawn():
    state = VelocityPrior().initial(Start.at(POSE), 20_000, np.random.default_rng(1))
    np.testing.assert_allclose(state.velocities.std(0), VELOCITY, rtol=0.04)


def test_velocities_at_the_start_go_the_shorter_way_round():
    before = BEFORE.copy()
    before[5] += 2 * np.pi
    states = [VelocityPrior().initial(Start.at(POSE, b), 10, np.random.default_rng(1)) for b in (BEFORE, before)]
    np.testing.assert_allclose(states[0].velocities, states[1].velocities, atol=1e-9)


def test_moving_a_body_changes_what_brought_it_there():
    prior, rng = VelocityPrior(), np.random.default_rng(2)
    state = prior.propagate(prior.initial(Start.at(POSE, BEFORE), 5, rng), rng)
    moved = prior.moved(state, state.poses + 0.1)
    np.testing.assert_allclose(moved.poses - moved.velocities / 30, state.poses - state.velocities / 30, atol=1e-12)
    stirred = prior.diffuse(state, 0.5, np.random.default_rng(3))
    np.testing.assert_allclose(stirred.poses - stirred.velocities / 30, state.poses - state.velocities / 30, atol=1e-12)
    taken = moved.take(np.array([4, 0]))
    np.testing.assert_array_equal(taken.velocities, moved.velocities[[4, 0]])


def test_an_arm_leaves_the_others_alone():
    prior, rng = VelocityPrior(part="right_arm"), np.random.default_rng(4)
    state = prior.initial(Start.at(POSE, BEFORE), 30, rng)
    for _ in range(3):
        state = prior.diffuse(prior.propagate(state, rng), 0.5, rng)
    others = [e for e in range(25) if e not in RIGHT_ARM]
    np.testing.assert_array_equal(state.poses[:, others], np.broadcast_to(POSE[others], (30, 21)))
    assert (state.poses[:, RIGHT_ARM].std(0) > 0.01).all()
    np.testing.assert_array_equal(prior.moved(state, state.poses + 1.0).poses[:, others], state.poses[:, others])


def test_the_noise_of_a_motion_is_that_of_its_second_differences(mocap):
    walk = motionenv.load("walk/fpca").synthesize(3, 120, seed=1)
    poses = walk.poses.copy()
    poses[100] = np.nan
    change, velocity = velocity_change([Motion(poses, walk.skeleton, 120.0)], fps=120)
    kept = [poses[:100], poses[101:]]
    wanted = np.concatenate([np.diff(p, 2, axis=0) for p in kept]) * 120
    np.testing.assert_allclose(change, np.sqrt((wanted**2).mean(0)), rtol=1e-9)
    assert velocity[0] == pytest.approx(np.abs(np.diff(walk.poses[:, 0])).mean() * 120, rel=0.05)
    captured = read_motion(mocap / "cmu_asfamc/07/07_01.amc", fps=120)
    change, _ = velocity_change([captured])
    assert 0.3 < np.median(change[6:] / CHANGE[6:]) < 1.5


def test_bad_numbers_are_told():
    with pytest.raises(MotionError, match="part"):
        VelocityPrior(part="tail")
    with pytest.raises(MotionError, match="change"):
        VelocityPrior(change=np.full(25, -1.0))
    with pytest.raises(MotionError, match="velocity"):
        VelocityPrior(velocity=np.zeros(3))
    with pytest.raises(MotionError, match="three frames"):
        velocity_change([])
