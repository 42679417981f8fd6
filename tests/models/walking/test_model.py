"""Walks from the shipped model: on the ground, smooth, at the asked speed, the same for the same seed."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import motionenv
from motionenv.body import LIMBS, forward, limb_segments
from motionenv.body.kinematics import FOOT_BALL
from motionenv.errors import ModelError, MotionError
from motionenv.models.walking.model import WalkerScores, WalkingModel
from motionenv.types import POSE, Motion

ANKLES, FEET = [13, 14], [10, 11]  # rows of nodes and of segments, left and right
HINGES = [POSE.index(f"{side}_{joint}_flexion") for side in ("left", "right") for joint in ("elbow", "knee")]
HIPS = [POSE.index(f"{side}_hip_flexion") for side in ("left", "right")]


@pytest.fixture(scope="module")
def model() -> WalkingModel:
    return motionenv.load("walk/fpca")


@pytest.fixture(scope="module")
def crowd(model) -> Motion:
    """60 walkers for 6 seconds."""
    return model.walks(6, 60, n=60, seed=5)


def soles(motion) -> np.ndarray:
    """Height (..., frames) [m] of the lowest point of both feet as drawn."""
    feet = [LIMBS.index("left_foot"), LIMBS.index("right_foot")]
    ends = limb_segments(motion.poses, motion.skeleton)[..., 2]
    return (ends - motion.skeleton.radii)[..., feet, :].min((-1, -2))


def steps(motion) -> list[np.ndarray]:
    """Per whole step of each walker (n, frames) the ways (frames, 2) [m] of the ball of the foot that stands.

    That foot is the one whose ball moves back fastest relative to the pelvis; a step ends when it changes.
    """
    nodes, rotations = forward(motion.poses, motion.skeleton)
    ball = (nodes[..., ANKLES, :] + rotations[..., FEET, :, :] @ (FOOT_BALL * motion.skeleton.height))[..., :2]
    stands = np.gradient(ball[..., 0] - nodes[..., 2:3, 0], axis=1).argmin(axis=-1)
    found = []
    for ways, foot in zip(ball, stands, strict=True):
        cuts = np.split(np.arange(len(foot)), np.flatnonzero(np.diff(foot)) + 1)[1:-1]
        found += [ways[cut, foot[cut[0]]] for cut in cuts]
    return found


def drifts(motion) -> np.ndarray:
    """Distance [m] between the ends of what the standing foot's ball moves over, in each step."""
    return np.array([np.hypot(*np.ptp(way, axis=0)) for way in steps(motion)])


def mean_speed(motion) -> np.ndarray:
    x = motion.poses[..., 0]
    return (x[..., -1] - x[..., 0]) * motion.fps / (x.shape[-1] - 1)


def test_standing_feet_stay_where_they_are(crowd):
    drift = drifts(crowd)
    assert len(drift) > 400
    assert np.percentile(drift, [50, 95, 99]) == pytest.approx([0, 0, 0], abs=0.008)
    assert np.median(drift) < 0.005


@pytest.mark.parametrize("speed", [0.8, 1.2, 1.6, 2.2])
def test_feet_stand_at_every_speed(model, speed):
    assert np.percentile(drifts(model.walks(6, 60, n=20, seed=2, speed=speed)), 99) < 0.012


def test_standing_feet_are_slow(crowd):
    """Independent of steps: the slower ball of the two, seen in the world, hardly moves, while the body does."""
    nodes, rotations = forward(crowd.poses, crowd.skeleton)
    ball = (nodes[..., ANKLES, :] + rotations[..., FEET, :, :] @ (FOOT_BALL * crowd.skeleton.height))[..., :2]
    slower = np.linalg.norm(np.diff(ball, axis=1), axis=-1).min(-1) * crowd.fps
    assert np.median(slower) < 0.03
    assert np.percentile(slower, 95) < 0.25
    assert mean_speed(crowd).min() > 0.5


def test_soles_are_on_the_ground(crowd):
    low = soles(crowd)
    assert np.mean(np.abs(low) < 0.02) > 0.99
    assert low.min() > -0.05


def test_bodies_move_as_people_do(crowd):
    poses = crowd.poses
    assert np.degrees(poses[..., HINGES].min()) > -1
    assert (poses[..., 2] > 0.39 * crowd.skeleton.height).all()
    assert (poses[..., 2] < 0.55 * crowd.skeleton.height).all()
    assert np.degrees(np.abs(poses[..., 3:6]).max()) < 35
    assert np.abs(poses[..., 1]).max() < 1.0
    left, right = np.moveaxis(poses[..., HIPS] - poses[..., HIPS].mean(1, keepdims=True), -1, 0)
    antiphase = (left * right).sum(1) / np.sqrt((left**2).sum(1) * (right**2).sum(1))
    assert (antiphase < -0.5).all()
    knees = poses[..., [POSE.index("left_knee_flexion"), POSE.index("right_knee_flexion")]]
    assert (np.degrees(np.ptp(knees, axis=1)) > 30).all()


def test_hips_and_head_turn_no_faster_than_peoples(crowd):
    """Captured walks turn the pelvis by up to 2.6 rad/s for 1 % of the time; a seam between cycles would show here."""
    for name in ("root_heading", "root_tilt", "root_obliquity", "neck_rotation"):
        rate = np.abs(np.diff(crowd.poses[..., POSE.index(name)], axis=1)) * crowd.fps
        assert np.percentile(rate, 99) < 2, name
        assert rate.max() < 4, name


def test_drawn_walkers_are_as_fast_as_captured_ones(model):
    """Speeds and stride times of 400 walkers have the mean and spread of the Gaussian that they come from."""
    strides = model.sample(400, seed=0)
    log = np.log(strides.seconds)
    spread = np.sqrt(model.person_covariance_[-2, -2])
    assert log.mean() == pytest.approx(model.person_mean_[-2], abs=5 * spread / 20)
    assert log.std() == pytest.approx(spread, rel=0.2)
    speeds = mean_speed(model.walks(5, 30, n=200, seed=1)) / model.height_
    expected, spread = model.person_mean_[-1], np.sqrt(model.person_covariance_[-1, -1])
    assert np.log(speeds).mean() == pytest.approx(expected, abs=0.1)  # feet on the ground take shorter strides
    assert np.log(speeds).std() == pytest.approx(spread, rel=0.25)


@pytest.mark.parametrize("speed", [0.7, 1.0, 1.4, 2.0])
def test_the_asked_speed_is_reached(model, speed):
    np.testing.assert_allclose(mean_speed(model.walks(8, 60, n=20, seed=4, speed=speed)), speed, rtol=0.02)


def test_faster_walkers_take_longer_and_quicker_strides(model):
    slow, fast = (model.sample(300, seed=1, speed=v) for v in (0.8, 1.8))
    assert fast.seconds.mean() < 0.9 * slow.seconds.mean()
    assert 1.8 * fast.seconds.mean() > 1.2 * 0.8 * slow.seconds.mean()


def test_smooth_in_value_and_two_derivatives_across_cycle_borders(model):
    """At 480 fps each derivative up to the third is no larger (15 %) within 4 frames of cycle borders than elsewhere.

    Nor does any grow with the frame rate, as it would where the one before it jumps.
    """
    fps, stride = 480, WalkerScores(model.sample(30, seed=8).scores, np.full(30, 1.1))
    poses = model.walks(8, fps, n=30, seed=9, stride=stride).poses
    frame = np.arange(poses.shape[1])
    near = (np.abs((frame / fps + 0.55) % 1.1 - 0.55) < 4 / fps) & (frame > 300) & (frame < 3500)
    for order in (1, 2, 3):
        change = np.abs(np.diff(poses, order, axis=1)).max(0)
        inside = near[: len(change)]
        assert (change[inside].max(0) <= 1.15 * change[~inside].max(0)).all()
    finer = model.walks(8, 2 * fps, n=30, seed=9, stride=stride).poses
    grown = [
        np.abs(np.diff(finer, order, axis=1)).max((0, 1)) * 2**order / np.abs(np.diff(poses, order, axis=1)).max((0, 1))
        for order in (1, 2, 3)
    ]
    np.testing.assert_allclose(grown[:2], 1, atol=0.1)
    assert (grown[2] < 1.5).all()  # a jump of the acceleration would double it


def test_without_variation_one_cycle_repeats(model):
    stride = WalkerScores(model.sample(4, seed=8).scores, np.full(4, 1.2))
    poses = model.walks(8, 60, n=4, seed=1, stride=stride, variation=0).poses[:, 60:-60]
    change = poses[:, 72:] - poses[:, :-72]
    change[..., :2] -= change[:, :1, :2]  # a stride further each time
    assert np.abs(change).max() < 2e-3
    inner = poses[:, 60:-60]
    np.testing.assert_allclose(inner[:, 72:, 2:], inner[:, :-72, 2:], atol=1e-5)


def test_variation_makes_cycles_differ_by_what_was_learned(model):
    """Scores of synthesised cycles spread about their walker's mean as the cycles of one trial do."""
    stride = WalkerScores(np.repeat(model.sample(1, seed=8).scores, 40, axis=0), np.full(40, 1.0))
    motion = model.walks(8, 64, n=40, seed=1, stride=stride)
    cycles = motion.poses[:, : 8 * 64, 6:].reshape(40, 8, 64, 19)
    grid = model.fpca_.evaluate(np.eye(8)[:, None], np.arange(64) / 64) - model.fpca_.evaluate(
        np.zeros((1, 8)), np.arange(64) / 64
    )
    design = np.concatenate([grid[..., :6].reshape(8, -1)]).T  # neck and left shoulder: never corrected
    values = cycles[..., :6].reshape(320, -1)
    scores = np.linalg.lstsq(design, (values - values.mean(0)).T, rcond=None)[0].T
    # Over a cycle a B-spline of independent points averages out to about 0.7 of their variance or more.
    ratio = np.trace(np.cov(scores.T)) / np.trace(model.cycle_covariance_)
    assert 0.5 < ratio < 2.0


def test_phase_starts_later_in_the_same_walk(model):
    walker = replace(model.walker(3), stride_seconds=1.2)
    start, later = (
        model.synthesize(5, 60, seed=0, walker=walker, variation=0, phase=phase).poses[60:-100] for phase in (0, 0.25)
    )
    np.testing.assert_allclose(start[18:, 2:], later[:-18, 2:], atol=1e-4)
    ahead = np.subtract(*model.synthesize(1.2, 60, seed=0, walker=walker, variation=0).poses[:, HIPS].T)
    assert min(ahead.argmax(), 72 - ahead.argmax()) <= 7  # phase 0: the left leg is furthest ahead


def test_height_scales_the_body(model):
    walker = model.walker(3)
    small, tall = (model.synthesize(3, 60, seed=0, walker=walker, height=h) for h in (1.2, 1.8))
    assert (small.skeleton.height, tall.skeleton.height) == (1.2, 1.8)
    np.testing.assert_allclose(tall.skeleton.offsets, 1.5 * small.skeleton.offsets)
    np.testing.assert_allclose(tall.poses[:, 2], 1.5 * small.poses[:, 2], rtol=0.01)
    assert mean_speed(tall) == pytest.approx(1.5 * mean_speed(small), rel=0.02)


@given(
    seconds=st.floats(0.02, 4), fps=st.floats(1, 240), seed=st.integers(0, 2**32), phase=st.floats(-9, 9),
    variation=st.floats(0, 2),
)  # fmt: skip
@settings(max_examples=25)
def test_any_length_and_rate_walks_from_the_origin(model, seconds, fps, seed, phase, variation):
    assume(round(seconds * fps) >= 1)
    motion = model.synthesize(seconds, fps, seed=seed, phase=phase, variation=variation)
    assert motion.poses.shape == (round(seconds * fps), 25)
    assert motion.fps == fps
    assert np.isfinite(motion.poses).all()
    np.testing.assert_array_equal(motion.poses[0, :2], 0)
    assert (np.diff(motion.poses[:, 0]) > -0.02).all()


def test_the_frame_rate_changes_how_often_not_what(model):
    coarse, fine = (model.synthesize(4, fps, seed=6).poses for fps in (30, 120))
    np.testing.assert_allclose(coarse[5:-5], fine[20:-20:4], atol=0.02)


@pytest.mark.parametrize("height", [0.5, 1.75])
@pytest.mark.parametrize("speed", [0.9, 1.0, 1.1, 2.0])
def test_a_frame_a_second_is_the_walk_at_a_higher_rate(model, speed, height):
    """Feet are followed for a second past the last frame then, which needs more strides than the frames themselves."""
    one, sixty = (model.synthesize(1, fps, seed=6, speed=speed, height=height, variation=0).poses for fps in (1, 60))
    np.testing.assert_allclose(one[0], sixty[0], atol=0.005)


def test_same_seed_same_bytes_in_another_process(model):
    code = "import sys, motionenv; sys.stdout.buffer.write(motionenv.load('walk/fpca').synthesize(2, 30, seed=7).poses)"
    environment = {**os.environ, "PYTHONPATH": str(Path(motionenv.__file__).parents[1])}
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, timeout=120, env=environment)
    assert said.stdout == model.synthesize(2, 30, seed=7).poses.tobytes()


def test_saved_and_loaded_it_walks_the_same(model, tmp_path):
    model.save(tmp_path / "walk.npz", {"trials": 1})
    back = motionenv.load(tmp_path / "walk.npz")
    assert back.card_ == {"trials": 1}
    assert back.synthesize(2, 30, seed=1).poses.tobytes() == model.synthesize(2, 30, seed=1).poses.tobytes()
    arrays, meta = model.to_arrays()
    with pytest.raises(ModelError, match=r"person_mean_ has shape \(3,\)"):
        WalkingModel.from_arrays({**arrays, "person_mean_": np.zeros(3)}, meta)


@pytest.mark.parametrize("n", [0, -3, 2.5])
def test_a_batch_has_a_whole_number_of_walks(model, n):
    with pytest.raises(MotionError, match="n must"):
        model.walks(1, 30, n=n, seed=0)


def test_before_fit_there_is_no_walk():
    for call in (
        lambda m: m.synthesize(1, 30),
        lambda m: m.sample(1),
        lambda m: m.to_arrays(),
        lambda m: m.skeleton(),
        lambda m: m.score([]),
    ):
        with pytest.raises(ModelError, match="not fitted"):
            call(WalkingModel())
    with pytest.raises(MotionError, match="a subject for each motion"):
        WalkingModel().fit([], [])


def test_memory_order_of_the_input_does_not_matter(model):
    walk = model.synthesize(4, 60, seed=1)
    turned = Motion(np.asfortranarray(walk.poses), walk.skeleton, walk.fps)
    assert model.score([turned]) == pytest.approx(model.score([walk]))


def test_given_walkers_and_requests_must_agree(model):
    three = model.sample(3, seed=0)
    with pytest.raises(MotionError, match="stride holds 3 walkers, but n is 5"):
        model.walks(2, 30, stride=three, n=5)
    with pytest.raises(MotionError, match=r"speed must be a number of m/s from 0\.1 to 3, got 99\.0"):
        model.walks(2, 30, stride=three, n=3, speed=99.0)
    assert np.isfinite(model.walks(20, 30, stride=three, n=3, speed=3.0).poses).all()


def test_walks_go_straight(model):
    """Over 20 s, whoever walks, however asymmetric; without variation, each stride goes exactly along x."""
    ways = model.walks(20, 30, n=40, seed=3).poses[:, -1, :2]
    assert np.degrees(np.abs(np.arctan2(ways[:, 1], ways[:, 0]))).max() < 0.8
    even = model.walks(8, 60, n=40, seed=3, variation=0.0)
    seconds = model.sample(40, seed=3).seconds
    for poses, stride in zip(even.poses[..., :2], seconds, strict=True):
        frames = np.arange(4) * stride * 60
        places = np.stack([np.interp(frames, np.arange(len(poses)), axis) for axis in poses.T], axis=-1)
        directions = np.degrees(np.arctan2(*np.diff(places, axis=0).T[::-1]))
        assert np.abs(directions).max() < 0.3
