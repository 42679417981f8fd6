"""Filled motions: known entries stay, gaps close smoothly and nearer to the truth than what needs no model."""

import warnings

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import motionenv
from motionenv import Motion
from motionenv.errors import GapError
from motionenv.models.filling import fill

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
