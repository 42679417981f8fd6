"""The prior of joint angles: what a Gaussian says, of walks that it knows and of motion that it doesn't."""

import numpy as np
import pytest

import motionenv
from motionenv.errors import GapError, MotionError
from motionenv.models.filling.prior import LAGS, LIMIT, NOISE, OFFSET, AnglePrior, prior_of
from motionenv.types import ANGLES

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
