"""Many walkers at once against the series, the model and the bodies that they stand for."""

import numpy as np
import pytest

import motionenv
from motionenv.models.eigenwalkers.batch import draw_walkers
from motionenv.models.eigenwalkers.fourier_series import LEFT_ANKLE, PELVIS, RIGHT_ANKLE, positions_at
from motionenv.models.eigenwalkers.locomotion import gait


@pytest.fixture(scope="module")
def model():
    return motionenv.load("walk/eigenwalkers")


@pytest.fixture(scope="module")
def walkers(model):
    return draw_walkers(model, 400, seed=0)


def test_positions_are_the_series(walkers):
    rng = np.random.default_rng(0)
    which, phases, sizes = rng.integers(400, size=50), rng.uniform(-50, 50, 50), rng.uniform(0.8, 1.2, 50)
    each = zip(which, phases, sizes, strict=True)
    expected = [size * positions_at(walkers.coefficients[i], [phase])[0] for i, phase, size in each]
    np.testing.assert_allclose(walkers.positions(which, phases, sizes), expected, atol=1e-12)


def test_they_stand_in_place_on_the_ground(walkers):
    cycle = positions_at(walkers.coefficients, np.arange(60) * 2 * np.pi / 60)
    np.testing.assert_allclose(cycle[:, :, PELVIS, :2].mean(axis=1), 0, atol=1e-9)
    ankles = cycle[..., [LEFT_ANKLE, RIGHT_ANKLE], 2].min(axis=(1, 2))
    assert ((ankles > 0.05) & (ankles < 0.09)).all()


def test_heights_and_strides_are_those_of_the_bodies(walkers):
    bodies = [gait(w) for w in walkers.coefficients[:25]]
    np.testing.assert_allclose(walkers.heights[:25], [b.skeleton.height for b in bodies], rtol=0.005)
    np.testing.assert_allclose(walkers.strides[:25], [b.stride_length for b in bodies], rtol=0.05)


def test_hardly_any_of_their_bodies_would_be_turned_down(walkers):
    assert all(gait(w).excess < np.radians(10) for w in walkers.coefficients[:25])


def test_they_are_distributed_as_the_model_says(model, walkers):
    standard = model.transform(walkers.coefficients) / np.sqrt(model.explained_variance_)
    se = 1 / np.sqrt(len(standard))
    assert (np.abs(standard[:, :3].mean(axis=0)) < 5 * se).all()  # others are touched by standing on the ground
    assert (np.abs(standard[:, :3].std(axis=0) - 1) < 5 * se).all()
    rest = np.log(walkers.frequencies) - np.log(model.frequency(standard * np.sqrt(model.explained_variance_)))
    assert rest.std() == pytest.approx(model.log_frequency_deviation_, rel=0.15)


def test_the_seed_decides(model):
    a, b = (draw_walkers(model, 5, seed=3) for _ in range(2))
    np.testing.assert_array_equal(a.coefficients, b.coefficients)
    assert (a.frequencies != draw_walkers(model, 5, seed=4).frequencies).all()
