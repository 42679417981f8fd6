"""Fourier walkers at other speeds: steps as long as asked, and the direction of people who walked at two speeds."""

import numpy as np
import pytest

import motionenv
from motionenv.models.eigenwalkers.fourier_series import FourierWalker, body_heights, mirrored, stride_lengths
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.speed import at_speed, longer
from motionenv.models.people.pace import EXPONENT


@pytest.fixture(scope="module")
def shipped():
    return motionenv.load("walk/eigenwalkers")


def test_steps_are_as_long_as_asked_and_bodies_keep_their_size(shipped):
    w = shipped.inverse_transform(
        np.random.default_rng(0).standard_normal((6, 10)) * np.sqrt(shipped.explained_variance_)
    )
    for change in (-0.2, 0.0, 0.1):
        made = longer(shipped, w, change)
        within = (
            np.log(stride_lengths(w) / body_heights(w))
            < np.log(stride_lengths(shipped.mean_) / body_heights(shipped.mean_[None])[0]) + 0.1
        )  # of longer steps the walkers reach half
        ratio = np.log(stride_lengths(made) / stride_lengths(w))
        np.testing.assert_allclose(ratio[within], change, atol=0.02)
        np.testing.assert_allclose(body_heights(made), body_heights(w), rtol=0.03)


def test_the_walk_ratio_hardly_changes_with_speed(shipped):
    w, seconds = shipped.mean_, 1.1
    own = stride_lengths(w) / seconds
    faster = at_speed(shipped, w, seconds, 1.2 * own)
    assert np.log(stride_lengths(faster) / stride_lengths(w)) == pytest.approx(
        shipped.speed_exponent_ * np.log(1.2), rel=1e-3
    )
    assert shipped.speed_exponent_ == pytest.approx(EXPONENT, abs=0.06)


def test_the_direction_is_that_of_people_who_walk_at_two_speeds(shipped):
    """Walks made along a known direction, of people who differ otherwise; it is symmetric, as what made it is."""
    rng = np.random.default_rng(2)
    own = shipped.inverse_transform(0.5 * rng.standard_normal((8, 10)) * np.sqrt(shipped.explained_variance_))
    pairs = [(w, longer(shipped, w, -0.25), str(i)) for i, w in enumerate(own)]
    walks = [FourierWalker(each, 0.9) for w, slow, _ in pairs for each in (w, slow)]
    model = Eigenwalkers(3).fit(walks, [who for _, _, who in pairs for _ in range(2)])
    ours, theirs = model.speed_direction_.ravel(), shipped.speed_direction_.ravel()
    assert ours @ theirs / np.linalg.norm(ours) / np.linalg.norm(theirs) > 0.95
    np.testing.assert_allclose(mirrored(model.speed_direction_), model.speed_direction_, atol=1e-12)
