"""Strides for models, cut from walks that are short, bent, or on a treadmill, are those of the whole straight walk."""

import numpy as np
import pytest

import motionenv
from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker, walker_of_strides
from motionenv.models.walking.model import WalkingModel
from motionenv.models.walking.preprocessing import CHANNELS, gait_channels, walking_cycles
from motionenv.models.walking.strides import captured_cycles, walk_strides
from motionenv.types import MARKERS, Markers, Motion

FPS = 100.0


@pytest.fixture(scope="module")
def walk() -> Motion:
    walk = motionenv.synthesize("walk/fpca", 9.0, FPS, seed=3, speed=1.2, variation=0.0)
    poses = walk.poses.copy()
    poses[:, 1] -= np.linspace(poses[0, 1], poses[-1, 1], len(poses))  # it strays by half a metre
    return changed(walk, poses)


@pytest.fixture(scope="module")
def cycle(walk) -> np.ndarray:
    """A cycle of the whole walk, (128, 24), as paper A finds it."""
    return walking_cycles([gait_channels(walk)], [FPS], ["she"]).values[2]


def changed(walk: Motion, poses: np.ndarray) -> Motion:
    return Motion(poses, walk.skeleton, walk.fps, walk.name)


def piece(walk: Motion, first: float, seconds: float) -> Motion:
    return changed(walk, walk.poses[round(first * FPS) : round((first + seconds) * FPS)])


def on_a_treadmill(walk: Motion) -> Motion:
    poses = walk.poses.copy()
    poses[:, 0] -= np.linspace(0, walk.poses[-1, 0] - walk.poses[0, 0], len(poses))
    return changed(walk, poses)


def on_a_circle(walk: Motion, radius: float, turn: float = 0.0) -> Motion:
    """The walk with the floor bent to the left about (0, radius), and all turned by `turn` [rad]."""
    poses = walk.poses.copy()
    angle = poses[:, 0] / radius
    out = radius - poses[:, 1]
    poses[:, 0], poses[:, 1] = out * np.sin(angle), radius - out * np.cos(angle)
    poses[:, 5] += angle + turn
    c, s = np.cos(turn), np.sin(turn)
    poses[:, :2] = poses[:, :2] @ np.array([[c, s], [-s, c]])
    return changed(walk, poses)


def shown(motion: Motion) -> Markers:
    return Markers(MARKERS, markers(motion.poses, motion.skeleton), motion.fps)


CAPTURES = {
    "a short walk": (lambda walk: piece(walk, 1.0, 1.6), "events"),
    "less than two contacts of a foot": (lambda walk: piece(walk, 1.2, 1.35), "phase"),
    "a treadmill": (on_a_treadmill, "events"),
    "a curve": (lambda walk: on_a_circle(walk, 2.0, 1.0), "events"),
}


@pytest.mark.parametrize("what", CAPTURES)
def test_each_stride_is_a_cycle_of_the_straight_walk(walk, cycle, what):
    change, by = CAPTURES[what]
    motion = change(walk)
    found = walk_strides(motion)
    assert found.found == by
    cycles = captured_cycles([motion], [found], ["she"])
    assert len(cycles.values) == len(found.strides) >= 1
    period = walk_strides(walk).strides[0].seconds
    np.testing.assert_allclose(cycles.seconds, period, rtol=0.03)
    error = np.nanmean(cycles.values, 0)[:, :19] - cycle[:, :19]
    assert np.sqrt((error**2).mean()) < np.radians(2.0)
    heading = cycles.values[:, :, CHANNELS.index("root_heading")]
    assert np.abs(np.nanmean(heading, 1) - cycle[:, CHANNELS.index("root_heading")].mean()).max() < np.radians(4.0)
    assert found.speed == pytest.approx(1.2, rel=0.06)


def test_a_curve_is_known_and_its_turn_is_the_drift_of_the_heading(walk):
    motion = on_a_circle(walk, 3.0)
    found = walk_strides(motion)
    whole = [s for s in found.strides if 1.5 < s.start and s.end < 7.5]
    assert len(whole) > 5
    np.testing.assert_allclose([s.curvature for s in whole], 1 / 3.0, rtol=0.15)
    drift = captured_cycles([motion], [found], ["she"]).drift[:, CHANNELS.index("root_heading")]
    lengths = np.array([s.length for s in found.strides])
    np.testing.assert_allclose(np.median(drift / lengths), 1 / 3.0, rtol=0.15)


@pytest.mark.parametrize("what", CAPTURES)
def test_the_fourier_walker_of_strides_is_that_of_the_straight_walk(walk, what):
    motion = CAPTURES[what][0](walk)
    found = walk_strides(motion)
    walker = walker_of_strides(shown(motion), found.strides, found.headings)
    whole = fourier_walker(shown(walk))
    assert walker.frequency == pytest.approx(whole.frequency, rel=0.03)
    error = np.linalg.norm(walker.coefficients - whole.coefficients, axis=-1)
    assert error.max() < 0.03
    assert walker.speed == pytest.approx(whole.speed, rel=0.06)


def test_who_goes_backwards_or_stands_is_left_out_with_the_reason(walk):
    poses = walk.poses[::-1].copy()
    with pytest.raises(MotionError, match="no stride goes ahead.*backwards"):
        walk_strides(changed(walk, poses))
    with pytest.raises(MotionError, match="no stride: no foot meets or leaves the ground twice"):
        walk_strides(changed(walk, np.repeat(walk.poses[:1], 200, axis=0)))


def test_a_model_of_single_strides_walks_as_they_do():
    """Six people, a stride or two of each: the model's strides are as long and as quick as theirs."""
    whole = [motionenv.synthesize("walk/fpca", 4.0, FPS, seed=i, speed=0.9 + 0.1 * i) for i in range(6)]
    short = [piece(walk, 1.0, 1.8) for walk in whole]
    model = WalkingModel().fit(short, "abcdef")
    assert (model.fpca_.n_cycles_) >= 6
    low, high = model.learned_speeds()
    assert 0.75 < low < 1.0 < 1.3 < high < 1.55
    walk = model.synthesize(5.0, 50.0, seed=1)
    travelled = np.linalg.norm(walk.poses[-1, :2] - walk.poses[0, :2]) / 5.0
    assert 0.7 < travelled < 1.7
    with pytest.raises(MotionError, match="strides of each motion"):
        WalkingModel().fit(short, "abcdef", [])
