"""Cycles of captured walks, which do not hang on where, whither and how fast somebody was filmed."""

import numpy as np
import pytest

import motionenv
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.errors import MotionError
from motionenv.mocap import read_motion
from motionenv.models.walking.preprocessing import (
    CHANNELS,
    STRAIGHT,
    find_cycles,
    forward_speed,
    gait_channels,
    straightness,
    walking_cycles,
)
from motionenv.types import POSE, Motion

LEAD = [CHANNELS.index("left_hip_flexion"), CHANNELS.index("right_hip_flexion")]


@pytest.fixture(scope="module")
def walk(mocap) -> Motion:
    return read_motion(mocap / "cmu_asfamc" / "07" / "07_01.amc", fps=120)


def elsewhere(motion, turn=0.0, shift=(0.0, 0.0, 0.0)) -> Motion:
    """The same motion, turned about the vertical and then moved."""
    poses = motion.poses.copy()
    c, s = np.cos(turn), np.sin(turn)
    poses[:, :2] = poses[:, :2] @ np.array([[c, s], [-s, c]])
    poses[:, :3] += shift
    poses[:, 5] += turn
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


@pytest.mark.parametrize("turn", [0.5, 3.0, -8.0])
def test_place_floor_and_direction_do_not_matter(walk, turn):
    moved = gait_channels(elsewhere(walk, turn, (5.0, -3.0, 0.2)))
    np.testing.assert_allclose(moved, gait_channels(walk), atol=1e-9)


def test_channels_are_angles_and_heights_of_ankles_above_the_ground(walk):
    channels = gait_channels(walk)
    np.testing.assert_array_equal(channels[:, :19], walk.poses[:, 6:])
    np.testing.assert_array_equal(channels[:, 19], walk.poses[:, POSE.index("root_tilt")])
    assert abs(channels[:, CHANNELS.index("root_heading")].mean()) < 0.1
    lowest = channels[:, -2:].min(axis=1)
    assert (lowest < ANKLE_HEIGHT).mean() == pytest.approx(0.1, abs=0.02)
    assert channels[:, -2:].max() < 0.3


def test_cycles_begin_where_the_left_leg_leads_and_end_where_they_began(walk):
    cycles = walking_cycles([gait_channels(walk)], [walk.fps], ["she"])
    mean = np.nanmean(cycles.values, axis=0)
    ahead = mean[:, LEAD[0]] - mean[:, LEAD[1]]
    fundamental = np.fft.rfft(ahead)[1]
    assert abs(np.angle(fundamental)) < 0.15
    values = cycles.values[np.isfinite(cycles.values).all(axis=(1, 2))]
    steps = np.abs(np.diff(values, axis=1)).max(axis=1)
    assert (np.abs(values[:, 0] - values[:, -1]) <= 2 * steps + 1e-9).all()
    assert set(cycles.subject) == {"she"}


def test_found_cycles_are_a_stride_apart_and_begin_with_the_left_leg_ahead(walk):
    found = find_cycles(walk)
    assert 0.9 < found.seconds < 1.4
    assert 0 <= found.starts[0] < found.seconds
    assert found.starts[-1] < len(walk.poses) / walk.fps
    np.testing.assert_allclose(np.diff(found.starts), found.seconds)
    flexion = walk.poses[:, [POSE.index("left_hip_flexion"), POSE.index("right_hip_flexion")]]
    ahead = flexion[:, 0] - flexion[:, 1]
    at = np.round(found.starts * walk.fps).astype(int)
    assert (ahead[at] > 0.5 * ahead.max()).all()


@pytest.mark.parametrize("speed", [0.7, 1.6])
def test_speed_is_that_of_the_walk_that_was_made_in_any_direction_and_with_gaps(speed):
    walk = motionenv.load("walk/fpca").synthesize(6, 60, seed=1, speed=speed, variation=0)
    assert forward_speed(walk) == pytest.approx(speed, rel=0.02)
    turned = elsewhere(walk, 2.0)
    poses = turned.poses.copy()
    poses[50:120, :2] = np.nan
    assert forward_speed(Motion(poses, walk.skeleton, 60)) == pytest.approx(speed, rel=0.02)


def test_straightness_is_the_way_over_the_path():
    poses = np.zeros((121, 25))
    angle = np.linspace(0, np.pi, 121)
    poses[:, 0], poses[:, 1] = np.cos(angle), np.sin(angle)
    body = motionenv.load("walk/fpca").skeleton()
    # Half a circle: 2 / π, but for the eight chords that stand for the arc.
    assert straightness(Motion(poses, body, 30)) == pytest.approx(2 / (16 * np.sin(np.pi / 16)))
    poses[:, 1] = 0
    assert straightness(Motion(poses, body, 30)) == pytest.approx(1)
    assert straightness(Motion(np.full((40, 25), np.nan), body, 30)) == 0.0


def test_capture_that_walks_straight_is_told_from_capture_that_turns(mocap):
    read = lambda trial: read_motion(mocap / "cmu_asfamc" / trial[:2] / f"{trial}.amc", fps=120)
    assert straightness(read("07_01")) > STRAIGHT > straightness(read("29_01"))


def test_what_has_no_way_or_is_many_is_refused(walk):
    with pytest.raises(MotionError, match=r"one walk \(frames, 25\) at a time, got poses of shape \(2, 40, 25\)"):
        gait_channels(Motion(np.zeros((2, 40, 25)), walk.skeleton, 30))
    with pytest.raises(MotionError, match="the root is never seen; leave this walk out"):
        forward_speed(Motion(np.full((40, 25), np.nan), walk.skeleton, 30))
