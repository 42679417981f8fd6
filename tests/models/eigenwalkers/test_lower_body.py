"""Eigenwalkers of captures that show legs only: those of the legs' markers, and NaN for the others."""

import numpy as np
import pytest

import motionenv
from motionenv import Eigenwalkers, Motion, WalkerPrior
from motionenv.errors import GapError
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import body_heights
from motionenv.types import MARKERS

LOWER = [MARKERS.index("pelvis"), *range(MARKERS.index("left_hip"), 15)]
UPPER = [i for i in range(15) if i not in LOWER]

pytestmark = pytest.mark.filterwarnings("error")


@pytest.fixture(scope="module")
def walks() -> list[Motion]:
    return [motionenv.synthesize("walk/fpca", 4.0, 50.0, seed=seed) for seed in range(6)]


def without(motion: Motion, part: slice) -> Motion:
    poses = motion.poses.copy()
    poses[:, part] = np.nan
    return Motion(poses, motion.skeleton, motion.fps)


@pytest.fixture(scope="module")
def lower(walks) -> Eigenwalkers:
    return Eigenwalkers().fit([without(walk, slice(6, 17)) for walk in walks])


def test_a_walker_of_legs_has_the_same_legs_and_no_trunk(walks):
    """The trunk's markers move with the pelvis of such a motion, which tells nothing of the trunk."""
    whole, some = fourier_walker(walks[0]), fourier_walker(without(walks[0], slice(6, 17)))
    np.testing.assert_allclose(some.coefficients[:, LOWER], whole.coefficients[:, LOWER], atol=0.002)
    assert np.isnan(some.coefficients[:, UPPER]).all()
    assert some.frequency == pytest.approx(whole.frequency, rel=0.01)


def test_eigenwalkers_are_those_of_the_markers_that_walks_show(walks, lower):
    """By the singular values of these markers alone."""
    w = np.array([fourier_walker(without(walk, slice(6, 17))).coefficients for walk in walks])[:, :, LOWER]
    flat = w.reshape(len(w), -1)
    spread = np.linalg.svd(flat - flat.mean(axis=0), compute_uv=False) ** 2 / (len(w) - 1)
    np.testing.assert_allclose(lower.explained_variance_, spread[: len(lower.explained_variance_)], rtol=1e-6)
    np.testing.assert_allclose(lower.mean_[:, LOWER], w.mean(axis=0), atol=1e-12)
    assert np.isnan(lower.mean_[:, UPPER]).all()
    assert not lower.components_[:, :, UPPER].any()
    np.testing.assert_allclose(lower.transform(w_full(w)), lower.scores_, atol=1e-9)


def w_full(w: np.ndarray) -> np.ndarray:
    """Walkers of which the upper markers are anything: a model that doesn't know them doesn't look at them."""
    full = np.ones((len(w), 5, 15, 3))
    full[:, :, LOWER] = w
    return full


def test_it_keeps_what_it_lacks_in_a_file(walks, lower, tmp_path):
    lower.save(tmp_path / "lower.npz")
    again = motionenv.load(tmp_path / "lower.npz")
    np.testing.assert_array_equal(again.mean_, lower.mean_)
    heights = body_heights(again.inverse_transform(again.explained_variance_[None] * 0))
    assert heights == pytest.approx(np.mean([walk.skeleton.height for walk in walks]), abs=0.05)


def test_it_walks_on_its_legs_and_has_no_arms(lower):
    walk = lower.synthesize(2.0, 60.0, seed=1, speed=1.4)
    assert np.isnan(walk.poses[:, 6:17]).all()
    assert np.isfinite(np.delete(walk.poses, range(6, 17), axis=1)).all()
    assert (walk.poses[-1, 0] - walk.poses[0, 0]) * 60 / 119 == pytest.approx(1.4, rel=0.05)
    assert {trait.name for trait in lower.traits()} == {"bounce", "step width", "height"}
    assert np.isfinite(motionenv.fill(walk).poses).all()


def test_priors_and_one_legged_walks_say_what_they_lack(walks):
    with pytest.raises(GapError, match=r"no walker shows head, .*motionenv\.fill"):
        WalkerPrior().fit([without(walk, slice(6, 17)) for walk in walks])
    with pytest.raises(GapError, match="no walker shows right_knee, right_ankle"):
        Eigenwalkers().fit([without(walk, slice(21, 25)) for walk in walks])
