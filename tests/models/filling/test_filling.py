"""Filling: by interpolation, by a model's prior, and both, against walks that were hidden."""

import warnings

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import motionenv
from motionenv import Motion
from motionenv.errors import GapError, MotionError
from motionenv.models.filling import fill
from motionenv.models.filling.motion import SCALE, around, interpolated
from motionenv.models.filling.prior import LAGS, LIMIT, NOISE, OFFSET, AnglePrior, prior_of
from motionenv.types import ANGLES


def gappy(values, first, last):
    values = np.array(values, dtype=float)
    values[first:last] = np.nan
    return values


def test_a_short_gap_in_a_slow_wave_is_closed():
    t = np.arange(200) / 100
    wave = np.sin(2 * np.pi * t)
    found = interpolated(gappy(wave, 90, 105), 90, 105, 100.0)
    np.testing.assert_allclose(found, wave[90:105], atol=0.02)


def test_it_meets_what_is_known_on_both_sides_without_a_jump():
    rng = np.random.default_rng(0)
    curve = np.cumsum(np.cumsum(rng.normal(size=300))) * 1e-3
    found = interpolated(gappy(curve, 100, 190), 100, 190, 100.0)
    steps = np.abs(np.diff(np.concatenate([curve[:100], found, curve[190:]])))
    assert steps[98:101].max() < 2 * np.abs(np.diff(curve)).max()
    assert steps[188:191].max() < 2 * np.abs(np.diff(curve)).max()


def test_far_inside_a_long_gap_only_the_level_is_left():
    found = interpolated(gappy(np.full(400, 3.0), 100, 300), 100, 300, 50.0)
    np.testing.assert_allclose(found, 3.0, atol=0.15)
    swinging = np.sin(np.arange(1000) / 50 * 2 * np.pi)
    found = interpolated(gappy(swinging, 400, 600), 400, 600, 50.0)
    middle = slice(round(6 * SCALE * 50), -round(6 * SCALE * 50))
    assert np.abs(found[middle]).max() < 0.3


def test_nothing_known_nearby_gives_zero():
    np.testing.assert_array_equal(interpolated(np.full(20, np.nan), 5, 15, 10.0), np.zeros(10))


@pytest.mark.parametrize("fps", [25.0, 100.0, 240.0])
def test_frames_around_a_gap_touch_it_and_are_as_many_at_every_rate(fps):
    frames = around(1000, 1200, 5000, fps)
    assert {999, 1200} <= set(frames)
    assert not ((frames >= 1000) & (frames < 1200)).any()
    assert len(frames) <= 2 * 75
    assert around(0, 3, 3, fps).size == 0


ARMS, LEGS = np.arange(11), np.arange(11, 19)
LEFT, RIGHT = ANGLES.index("left_shoulder_flexion"), ANGLES.index("right_shoulder_flexion")


@pytest.fixture(scope="module")
def prior() -> AnglePrior:
    return prior_of("walk/fpca")


def shown(angles) -> np.ndarray:
    angles = np.array(angles)
    angles[:, ARMS] = np.nan
    return angles


def test_the_conditional_mean_is_that_of_the_joint_gaussian():
    """Against the partitioned Gaussian of the observed values themselves, in the middle of a motion of two channels."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(95, 95)) * 0.05
    prior = AnglePrior(rng.normal(size=19) * 0.1, (root @ root.T).reshape(5, 19, 5, 19))
    angles = np.full((101, 19), np.nan)
    angles[:, [3, 12]] = prior.mean[[3, 12]] + 0.05 * rng.normal(size=(101, 2))
    found = prior.predict(angles, 100.0, np.array([0, 7]))[50]
    taps = np.array([50 + round(lag * 100) for lag in LAGS])
    seen = (angles[taps][:, [3, 12]] - prior.mean[[3, 12]]).ravel()
    rows = [lag * 19 + angle for lag in range(5) for angle in (3, 12)]
    full = (root @ root.T) + NOISE**2 * np.eye(95) + OFFSET**2 * np.kron(np.ones((5, 5)), np.eye(19))
    inverse = np.linalg.inv(full[np.ix_(rows, rows)])
    assert np.sqrt(seen @ inverse @ seen / 10) < LIMIT
    cross = (root @ root.T)[np.ix_([38, 38 + 7], rows)]
    np.testing.assert_allclose(found, prior.mean[[0, 7]] + cross @ inverse @ seen, atol=1e-12)


def test_arms_swing_against_the_legs_and_as_the_other_side_mirrored(prior):
    walk = motionenv.synthesize("walk/fpca", 3.0, 60.0, seed=11, speed=1.3)
    arms = prior.predict(shown(walk.angles), 60.0, ARMS)
    hip = walk.angles[:, ANGLES.index("left_hip_flexion")]
    assert np.corrcoef(arms[:, LEFT], hip)[0, 1] < -0.7
    assert np.corrcoef(arms[:, LEFT], arms[:, RIGHT])[0, 1] < -0.8
    mirrored = motionenv.body.mirror(walk.poses)[:, 6:]
    other = prior.predict(shown(mirrored), 60.0, ARMS)
    np.testing.assert_allclose(other[:, RIGHT], arms[:, LEFT], atol=1e-9)


def test_motion_unlike_walking_has_nearly_the_mean_posture(prior):
    """Of somebody who sits the arms are the average walker's, within 20 degrees; of nothing known, exactly."""
    sitting = np.zeros((40, 19))
    sitting[:, [11, 14, 15, 18]] = np.radians(90)
    arms = prior.predict(shown(sitting), 50.0, ARMS)
    assert np.abs(arms - prior.mean[ARMS]).max() < np.radians(20)
    nothing = prior.predict(np.full((4, 19), np.nan), 50.0, ARMS)
    np.testing.assert_array_equal(nothing, np.tile(prior.mean[ARMS], (4, 1)))


def test_limbs_tell_nothing_of_the_neck(prior):
    walk = motionenv.synthesize("walk/fpca", 2.0, 60.0, seed=1, speed=1.6)
    neck = prior.predict(shown(walk.angles), 60.0, np.arange(3))
    np.testing.assert_allclose(neck, np.tile(prior.mean[:3], (len(neck), 1)), atol=1e-12)


@pytest.mark.parametrize("fps", [25.0, 60.0, 120.0])
def test_the_frame_rate_does_not_matter(prior, fps):
    walk = motionenv.synthesize("walk/fpca", 2.0, 600.0, seed=4, speed=1.2)
    step = round(600 / fps)
    fine, coarse = (prior.predict(shown(walk.angles[::k]), 600 / k, ARMS) for k in (5, step))
    n = 600 / np.lcm(5, step)
    at = np.arange(int(2 * n)) / n
    middle = (at > 0.3) & (at < 1.7)
    a, b = (x[np.round(at[middle] * rate).astype(int)] for x, rate in ((fine, 120), (coarse, fps)))
    np.testing.assert_allclose(a, b, atol=np.radians(1.0))


def test_models_that_lack_what_is_to_be_filled_are_refused():
    walks = [motionenv.synthesize("walk/fpca", 5.0, 40.0, seed=seed) for seed in range(4)]
    poses = [walk.poses.copy() for walk in walks]
    for pose in poses:
        pose[:, 6:17] = np.nan
    lower = [motionenv.Motion(pose, walk.skeleton, walk.fps) for pose, walk in zip(poses, walks, strict=True)]
    with pytest.raises(GapError, match="filling by the walking model needs the neck, the left arm and the right arm"):
        prior_of(motionenv.WalkingModel(2).fit(lower))
    with pytest.raises(MotionError, match="walk/fpc"):
        prior_of("walk/fpc")


UPPER = slice(6, 17)


@pytest.fixture(autouse=True)
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture(scope="module")
def walk() -> Motion:
    return motionenv.synthesize("walk/eigenwalkers", 4.0, 60.0, seed=3, speed=1.3)


def without(motion: Motion, entries, frames=slice(None)) -> Motion:
    poses = motion.poses.copy()
    poses[frames, entries] = np.nan
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


def rms(motion: Motion, truth: Motion, mask) -> float:
    """Root mean square difference [degrees]."""
    return float(np.degrees(np.sqrt(((motion.poses - truth.poses)[mask] ** 2).mean())))


def test_known_entries_stay_and_what_the_model_gave_is_marked(walk):
    lower = without(walk, UPPER)
    found = fill(lower)
    np.testing.assert_array_equal(found.filled, np.isnan(lower.poses))
    np.testing.assert_array_equal(found.poses[~found.filled], walk.poses[~found.filled])
    assert np.isfinite(found.poses).all()
    np.testing.assert_array_equal(fill(lower).poses, found.poses)
    assert fill(walk) is walk
    again = fill(Motion(np.where(np.arange(25) == 20, np.nan, found.poses), found.skeleton, 60.0, filled=found.filled))
    np.testing.assert_array_equal(again.filled[0], [6 <= i < 17 or i == 20 for i in range(25)])


def test_hidden_arms_are_nearer_than_a_mean_posture(mocap):
    """Of people whose walks no shipped model has seen, in degrees; also of one arm, and of a whole leg."""
    for name in ("Full", "Hole", "One"):
        truth = motionenv.read_motion(mocap / "btkdata/C3DSamples/PiG" / f"PiG_Motion-FlatFoot-{name}.c3d")
        known = np.isfinite(truth.poses)
        cases = (range(9, 17), UPPER), (range(9, 13), range(9, 13)), (range(21, 25), range(21, 25))
        for entries, hidden in cases:
            mask = known & np.isin(np.arange(25), entries)
            found = fill(without(truth, hidden))
            posture = Motion(np.tile(fill(without(walk_mean(truth), hidden)).poses[:1], (len(known), 1)),
                             truth.skeleton, truth.fps)  # fmt: skip
            assert rms(found, truth, mask) < rms(posture, truth, mask) + 0.5
        arms = fill(without(truth, UPPER)).poses
        swing = [np.corrcoef(arms[known.all(1), i], truth.poses[known.all(1), i])[0, 1] for i in (9, 13)]
        assert min(swing) > 0.7


def walk_mean(motion: Motion) -> Motion:
    """Somebody who stands as `motion` does on average."""
    return Motion(np.tile(np.nanmean(motion.poses, axis=0), (len(motion.poses), 1)), motion.skeleton, motion.fps)


@pytest.mark.parametrize(("entries", "seconds"), [([20], 0.2), ([20], 0.5), (range(17, 21), 0.3)])
def test_gaps_in_time_are_nearer_than_splines_and_do_not_jump(walk, entries, seconds):
    errors, splines = [], []
    t = np.arange(len(walk.poses))
    for first in range(40, 180, 20):
        gap = slice(first, first + round(seconds * 60))
        missing = without(walk, list(entries), gap)
        mask = np.isnan(missing.poses)
        found = fill(missing)
        known = ~mask.any(axis=1)
        spline = Motion(CubicSpline(t[known], walk.poses[known])(t), walk.skeleton, walk.fps)
        errors.append(rms(found, walk, mask))
        splines.append(rms(spline, walk, mask))
        border = np.abs(np.diff(found.poses[:, 6:], axis=0))[[gap.start - 1, gap.stop - 1]]
        assert border.max() < 1.5 * np.abs(np.diff(walk.poses[:, 6:], axis=0)).max()
    assert np.mean(errors) < np.mean(splines)


def test_lost_frames_are_bridged_and_the_way_goes_on(walk):
    """A quarter of a second without anything: the body is within centimetres; longer gaps and ends stay unknown."""
    found = fill(without(walk, slice(None), slice(100, 115)))
    np.testing.assert_allclose(found.poses[100:115, :3], walk.poses[100:115, :3], atol=0.02)
    assert found.filled[100:115].all()
    long = fill(without(walk, slice(None), slice(100, 160)))
    assert np.isnan(long.poses[100:160]).all()
    assert not long.filled.any()
    ends = fill(without(without(walk, slice(None), slice(0, 5)), UPPER))
    assert np.isnan(ends.poses[:5]).all()
    assert np.isfinite(ends.poses[5:]).all()


def test_whole_turns_of_an_angle_are_kept(walk):
    turned = walk.poses.copy()
    turned[:, 17] += 2 * np.pi
    turned[:, 5] += 50 * np.pi
    gap = Motion(turned, walk.skeleton, walk.fps)
    found = fill(without(gap, slice(None), slice(60, 70)))
    np.testing.assert_allclose(found.poses[:, 17], turned[:, 17], atol=np.radians(10))
    np.testing.assert_allclose(found.poses[:, 5], turned[:, 5], atol=np.radians(5))


def test_batches_and_single_frames_are_filled(walk):
    both = np.stack([walk.poses[:50], walk.poses[50:100]])
    both[..., UPPER] = np.nan
    found = fill(Motion(both, walk.skeleton, 60.0))
    np.testing.assert_array_equal(found.poses[1], fill(Motion(both[1], walk.skeleton, 60.0)).poses)
    assert np.isfinite(fill(Motion(both[0, :1], walk.skeleton, 60.0)).poses).all()


def test_a_motion_without_a_root_is_refused(walk):
    with pytest.raises(GapError, match="filling needs the root"):
        fill(without(walk, slice(0, 1)))


def test_another_models_prior_fills_otherwise(walk):
    lower = without(walk, UPPER)
    assert np.abs(fill(lower, model="walk/prior").poses - fill(lower).poses).max() > np.radians(1)
