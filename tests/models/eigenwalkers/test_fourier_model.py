"""Walkers as combinations of components, against least squares, scipy's Gaussian, Monte Carlo and eq. 3.1."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from motionenv.errors import ModelError, MotionError
from motionenv.models.eigenwalkers.fourier_series import grounded, positions_at
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.registry import load
from motionenv.models.storage.model_file import save_model
from motionenv.types import MARKERS


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_transform_undoes_inverse_transform(model, k):
    np.testing.assert_allclose(model.transform(model.inverse_transform(k)), k, atol=1e-9)


def test_transform_is_least_squares_on_what_is_known(model, walkers):
    w = walkers[0].coefficients.copy()
    w[:, [5, 7, 11, 13]] = np.nan
    known = np.isfinite(w).reshape(-1)
    a, b = model.components_.reshape(3, -1)[:, known].T, (w - model.mean_).reshape(-1)[known]
    np.testing.assert_allclose(model.transform(w), np.linalg.lstsq(a, b, rcond=None)[0], atol=1e-9)
    np.testing.assert_array_equal(model.transform(np.full((5, 15, 3), np.nan)), np.zeros(3))


def test_density_of_scores_is_the_gaussian_one(model, walkers):
    k = np.random.default_rng(0).standard_normal((5, 3)) * np.sqrt(model.explained_variance_)
    expected = multivariate_normal(np.zeros(3), np.diag(model.explained_variance_)).logpdf(k)
    np.testing.assert_allclose(model.score_samples(k), expected)
    mean = model.score_samples(model.transform(np.stack([w.coefficients for w in walkers]))).mean()
    assert model.score(walkers) == pytest.approx(mean)


def test_drawn_walkers_have_the_models_moments(model):
    drawn = model.sample(150, seed=3)
    k = model.transform(drawn)
    error = np.sqrt(model.explained_variance_ / 150)
    assert (np.abs(k.mean(0)) < 5 * error).all()
    np.testing.assert_allclose(k.var(0), model.explained_variance_, rtol=0.5)
    log = np.log([w.frequency for w in drawn])
    assert abs(log.mean() - model.log_frequency_mean_) < 5 * log.std() / 12


def test_same_seed_same_walk(model):
    a, b, c = (model.synthesize_markers(1.0, 30.0, seed=s).positions for s in (7, np.random.default_rng(7), 8))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 1e-3
    first, second = (model.sample(3, seed=5) for _ in range(2))
    assert all((x.coefficients == y.coefficients).all() for x, y in zip(first, second, strict=True))
    np.testing.assert_array_equal(model.synthesize(1.0, seed=7).poses, model.synthesize(1.0, seed=7).poses)


def test_in_place_it_is_equation_3_1(model):
    k = np.sqrt(model.explained_variance_) * [1, -1, 0.5]
    made = model.synthesize_markers(2.0, 50.0, walker=model.walker(scores=k), phase=0.25, overground=False)
    phase = 2 * np.pi * (0.25 + float(model.frequency(k)) * np.arange(100) / 50)
    expected = positions_at(grounded(model.inverse_transform(k)), phase)
    np.testing.assert_allclose(made.positions, expected, atol=1e-9)
    assert made.names == MARKERS


@pytest.mark.parametrize("speed", [0.8, 1.4])
def test_it_walks_as_fast_as_asked_along_x(model, speed):
    positions = model.synthesize_markers(6.0, 60.0, seed=1, speed=speed).positions
    pelvis = positions[:, MARKERS.index("pelvis")]
    assert (pelvis[-1] - pelvis[0])[0] / 5.98 == pytest.approx(speed, rel=0.03)
    assert np.abs(np.polyfit(pelvis[:, 0], pelvis[:, 1], 1)[0]) < 0.03


def test_saved_and_loaded_it_is_the_same(model, tmp_path):
    model.save(tmp_path / "walkers.npz", card={"people": 14})
    same = load(tmp_path / "walkers.npz")
    assert (same.n_people_, same.n_walkers_, same.card_) == (14, 14, {"people": 14})
    np.testing.assert_array_equal(same.synthesize(1.0, seed=4).poses, model.synthesize(1.0, seed=4).poses)


def test_a_model_file_with_other_shapes_is_refused(model, tmp_path):
    arrays, meta = model.to_arrays()
    save_model(tmp_path / "bad.npz", "eigenwalkers", arrays | {"mean_": np.zeros((5, 14, 3))}, meta)
    with pytest.raises(ModelError, match=r"mean_ has shape \(5, 14, 3\)"):
        load(tmp_path / "bad.npz")


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda m: m.synthesize(0.0), "seconds"),
        (lambda m: m.synthesize(1.0, fps=-3.0), "fps"),
        (lambda m: m.synthesize(1.0, speed=20.0), "speed"),
        (lambda m: m.synthesize(1.0, speed=2.9, height=0.6), "speed of the walker's own body"),
        (lambda m: m.synthesize_markers(1.0, walker=m.walker(scores=[1.0] * 9)), "scores"),
        (lambda m: m.sample(0), "n must"),
        (lambda m: m.transform(np.zeros((5, 45))), r"shape \(..., 5, 15, 3\), got \(5, 45\)"),
        (lambda m: m.transform(np.full((5, 15, 3), np.inf)), "finite or NaN"),
        (lambda m: m.inverse_transform([0.0]), r"scores must be finite, of shape \(..., 3\), got \(1,\)"),
        (lambda m: m.frequency([0.0, np.nan, 0.0]), "scores must be finite"),
        (lambda m: Eigenwalkers().sample(1), "not fitted"),
    ],
)
def test_what_makes_no_sense_is_refused(model, call, says):
    with pytest.raises(MotionError, match=says):
        call(model)
