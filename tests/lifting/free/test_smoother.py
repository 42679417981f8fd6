"""The fit of all frames: exact where the rays are, faithful to bodies where they are not."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.lifting.free.posture_network import BODY_UNIT
from motionenv.lifting.free.smoother import DEFAULTS, contacts, sample, smooth, solve
from motionenv.models.synthesis import synthesize
from motionenv.types import MARKERS

FPS = 30.0
MOTION = synthesize("walk/fpca", 3, FPS, seed=2)
WORLD = markers(MOTION.poses, MOTION.skeleton)
PLACES = (WORLD - [1.5, -5.0, 1.2]) / BODY_UNIT
RAYS = PLACES / np.linalg.norm(PLACES, axis=-1, keepdims=True)
POSTURE = PLACES - PLACES[:, [2]]
SPREAD = np.full(RAYS.shape[:2], 0.1)
STILL = np.zeros((len(RAYS), 3))


def fitted(rays=RAYS, posture=POSTURE, precision=None):
    return smooth(
        rays, STILL, np.ones(SPREAD.shape) if precision is None else precision, posture, SPREAD, FPS, DEFAULTS
    )


def error(fit) -> float:
    """Mean distance [mm] about the pelvis."""
    about = (fit.places - fit.places[:, [2]] - POSTURE) * BODY_UNIT
    return 1000 * float(np.linalg.norm(about, axis=-1).mean())


def test_exact_rays_and_postures_give_the_motion():
    fit = fitted()
    assert error(fit) < 8
    assert np.linalg.norm((fit.places - PLACES) * BODY_UNIT, axis=-1).max() < 0.06
    assert (fit.deviations > 0).all()


def test_rays_correct_proposals_and_proposals_fill_gaps():
    rng = np.random.default_rng(0)
    offset = POSTURE + 0.15 * rng.standard_normal((1, 15, 3)) * (np.arange(15) != 2)[:, None]
    before = 1000 * BODY_UNIT * np.linalg.norm(offset - POSTURE, axis=-1).mean()
    assert error(fitted(posture=offset)) < 0.6 * before
    gaps = RAYS.copy()
    gaps[30:50, MARKERS.index("left_wrist")] = np.nan
    assert error(fitted(rays=gaps)) < 10


def test_outliers_and_little_confidence_count_little():
    rng = np.random.default_rng(1)
    wild = RAYS.copy()
    where = rng.uniform(size=RAYS.shape[:2]) < 0.05
    wild[where] += 0.1 * rng.standard_normal((where.sum(), 3))
    wild /= np.linalg.norm(wild, axis=-1, keepdims=True)
    fit = fitted(rays=wild)
    assert error(fit) < 15
    assert fit.weights[where].mean() < 0.3 * fit.weights[~where].mean()
    told = fitted(rays=wild, precision=np.where(where, 0.01, 1.0))
    assert error(told) <= error(fit)


@pytest.mark.parametrize("noise", [0.004, 0.012])
def test_noise_brings_nobody_closer(noise):
    """Squared distances from rays alone are smaller near the camera: they are by 0.8 and 5 % too near then."""
    noisy = RAYS + noise * np.random.default_rng(0).standard_normal(RAYS.shape)
    fit = fitted(rays=noisy / np.linalg.norm(noisy, axis=-1, keepdims=True))
    away, true = (np.linalg.norm(places[:, 2], axis=-1).mean() for places in (fit.places, PLACES))
    assert abs(away / true - 1) < 0.006


def test_limbs_keep_their_lengths():
    rng = np.random.default_rng(2)
    noisy = RAYS + 0.004 * rng.standard_normal(RAYS.shape)
    fit = fitted(rays=noisy / np.linalg.norm(noisy, axis=-1, keepdims=True))
    knee, ankle = MARKERS.index("left_knee"), MARKERS.index("left_ankle")
    lengths = np.linalg.norm(fit.places[:, knee] - fit.places[:, ankle], axis=-1)
    assert lengths.std() / lengths.mean() < 0.04


@pytest.mark.parametrize("frames", [1, 2, 3, 8])
def test_few_frames_will_do(frames):
    part = slice(0, frames)
    fit = smooth(RAYS[part], STILL[part], np.ones((frames, 15)), POSTURE[part], SPREAD[part], FPS, DEFAULTS)
    assert np.isfinite(fit.places).all()


def test_feet_stand_where_they_are_slow_and_low():
    chance, floor = contacts(PLACES, FPS)
    ankles = PLACES[:, [MARKERS.index("left_ankle"), MARKERS.index("right_ankle")]]
    speed = np.linalg.norm(np.gradient(ankles, axis=0), axis=-1) * FPS * BODY_UNIT
    assert speed[chance > 0.5].mean() < 0.5 * speed[chance < 0.5].mean()
    assert 0.5 < chance.mean(axis=0).max() < 0.8  # people stand on each foot for about 60 % of a stride
    assert floor * BODY_UNIT + 1.2 == pytest.approx(np.quantile(WORLD[:, [13, 14], 2], 0.2), abs=0.03)


FEW = slice(1, 3)


def system(frames: int, n: int, rng: np.random.Generator):
    """Blocks of a positive definite matrix in which few unknowns couple frames two apart, the matrix, a right side."""
    rows = rng.standard_normal((3 * frames * n, frames * n))
    frame, unknown = np.divmod(np.arange(frames * n), n)
    distance, few = abs(frame[:, None] - frame), (FEW.start <= unknown) & (unknown < FEW.stop)
    coupled = (distance <= 1) | ((distance == 2) & few & few[:, None])
    dense = (rows.T @ rows) * coupled + 60 * np.eye(frames * n)
    blocks = dense.reshape(frames, n, frames, n)
    apart = lambda k: np.array([blocks[t, :, t + k] for t in range(frames - k)]).reshape(-1, n, n)
    return (apart(0), apart(1), apart(2)[:, FEW, FEW], FEW), dense, rng.standard_normal((frames, n))


@pytest.mark.parametrize("frames", [1, 2, 3, 6, 7])
def test_solution_and_covariances_are_those_of_dense_algebra(frames):
    blocks, dense, right = system(frames, 4, np.random.default_rng(frames))
    own, next_, *others = blocks
    solution, covariance = solve(own.copy(), next_.copy(), *others, right, True)
    np.testing.assert_allclose(solution.ravel(), np.linalg.solve(dense, right.ravel()), rtol=1e-10)
    inverse = np.linalg.inv(dense).reshape(frames, 4, frames, 4)
    np.testing.assert_allclose(covariance, [inverse[t, :, t] for t in range(frames)], rtol=1e-9)
    assert solve(*blocks, right)[1] is None


def test_what_frames_do_not_determine_is_told():
    (own, *others), _, right = system(4, 2, np.random.default_rng(0))
    own[1] = -np.eye(2)
    with pytest.raises(MotionError, match="don't determine"):
        solve(own, *others, right)


@pytest.mark.parametrize("seen", [("hip", "knee", "ankle"), ("hip", "shoulder", "head"), ("",)])
@pytest.mark.parametrize("noise", [0.0017, 0.043])
def test_deviations_are_never_wider_than_before_anything_is_seen(seen, noise):
    """Rays, limbs and floors only narrow what is proposed: rounding must not grow from frame to frame."""
    motion = synthesize("walk/fpca", 8, FPS, seed=3)
    places = (markers(motion.poses, motion.skeleton) - [1.5, -5.0, 1.2]) / BODY_UNIT
    rays = places / np.linalg.norm(places, axis=-1, keepdims=True)
    rays[:, [not any(part in name for part in seen) for name in MARKERS]] = np.nan
    settings = replace(DEFAULTS, least_ray=noise)
    spread = np.full(rays.shape[:2], 0.1)
    still = np.zeros((len(rays), 3))
    fit = smooth(rays, still, np.ones(spread.shape), places - places[:, [2]], spread, FPS, settings)
    assert (fit.deviations <= 0.1 * np.hypot(DEFAULTS.posture, 1.3 * 0.83) + 1e-9).all()


@pytest.mark.parametrize("frames", [1, 3, 6])
def test_draws_spread_as_the_dense_inverse_tells(frames):
    blocks, dense, _ = system(frames, 4, np.random.default_rng(frames))
    count = 200_000
    drawn = sample(*blocks, count, np.random.default_rng(1)).reshape(count, -1)
    inverse = np.linalg.inv(dense)
    error = np.sqrt((np.outer(np.diag(inverse), np.diag(inverse)) + inverse**2) / count)  # of a sample's covariance
    assert (np.abs(drawn.T @ drawn / count - inverse) < 5 * error).all()
    assert (np.abs(drawn.mean(axis=0)) < 5 * np.sqrt(np.diag(inverse) / count)).all()


def test_draws_of_a_fit_spread_about_the_pelvis_as_its_deviations():
    fit, rng = fitted(), np.random.default_rng(0)
    lasting = rng.standard_normal((400, 15, 3))
    lasting[:, 2] = 0.0
    drawn = fit.passing(400, rng) + fit.lasting_for(lasting)
    about = np.delete(drawn - drawn[:, :, [2]], 2, axis=2)
    ratio = about.std(axis=0) / np.delete(fit.deviations, 2, axis=1)
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
    assert (np.abs(ratio - 1) < 0.4).all()
    hips = (about[:, :, MARKERS.index("left_hip") - 1] * about[:, :, MARKERS.index("right_hip") - 1]).mean()
    assert hips < 0  # errors turn the hips
