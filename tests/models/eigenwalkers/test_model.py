"""Eigenwalkers against numpy's eigendecomposition, Monte Carlo, hidden data, and the ground that they walk on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

import motionenv
from motionenv.errors import ModelError, MotionError
from motionenv.models.eigenwalkers import fourier_model
from motionenv.models.eigenwalkers.fourier_series import (
    FourierWalker,
    centred,
    grounded,
    in_phase,
    positions_at,
    stride_lengths,
)
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.registry import load
from motionenv.models.storage.model_file import save_model
from motionenv.types import MARKERS
from tests.models.eigenwalkers.walks import hide, made_markers, walker


def matrix(walkers) -> np.ndarray:
    return np.stack([w.coefficients.reshape(-1) for w in walkers])


def test_components_are_the_eigenvectors_of_the_covariance(walkers):
    full = Eigenwalkers().fit(walkers)
    values, vectors = np.linalg.eigh(np.cov(matrix(walkers).T))
    np.testing.assert_allclose(full.explained_variance_, values[::-1][:13], rtol=1e-7, atol=1e-12)
    flat = full.components_.reshape(13, -1)
    np.testing.assert_allclose(np.abs((flat[:5] * vectors.T[::-1][:5]).sum(1)), 1, atol=1e-6)
    np.testing.assert_allclose(flat @ flat.T, np.eye(13), atol=1e-12)
    assert full.explained_variance_ratio_.sum() == pytest.approx(1)
    np.testing.assert_allclose(full.mean_.reshape(-1), matrix(walkers).mean(0), atol=1e-12)
    assert (np.take_along_axis(flat, np.abs(flat).argmax(1)[:, None], 1) > 0).all()


def test_all_components_give_the_walkers_back(walkers):
    full = Eigenwalkers().fit(walkers)
    coefficients = np.stack([w.coefficients for w in walkers])
    np.testing.assert_allclose(full.inverse_transform(full.transform(coefficients)), coefficients, atol=1e-10)
    np.testing.assert_allclose(full.transform(walkers[3]), full.scores_[3], atol=1e-12)


@pytest.mark.parametrize("kind", [Eigenwalkers, WalkerPrior])
def test_there_are_as_many_components_as_dimensions_that_walkers_span(kind, walkers):
    """Ten people who are mixtures of three walkers differ along two directions; the rest would be rounding errors."""
    shares = np.random.default_rng(2).dirichlet(np.ones(3), 10)
    mixed = np.tensordot(shares, np.stack([w.coefficients for w in walkers[:3]]), 1)
    model = kind().fit([FourierWalker(w, 1.0) for w in mixed])
    assert len(model.components_) == (2 if kind is Eigenwalkers else 5)  # mirror images span as many again, and one
    assert model.explained_variance_.min() > 1e-9
    np.testing.assert_allclose(model.inverse_transform(model.transform(mixed)), mixed, atol=1e-10)


def test_walkers_who_are_all_alike_are_refused(walkers):
    with pytest.raises(MotionError, match="these 4 walkers are all alike"):
        Eigenwalkers().fit([walkers[0]] * 4)


def test_a_person_counts_once(walkers):
    people = ["a", "b", "c", "a", "a", "b", "d"]
    model = Eigenwalkers().fit(walkers[:7], people)
    means = [np.mean([w.coefficients for w, p in zip(walkers, people, strict=False) if p == q], 0) for q in "abcd"]
    again = Eigenwalkers().fit([FourierWalker(centred(in_phase(m)), 1.0) for m in means])
    assert (model.n_people_, model.n_walkers_, model.people_) == (4, 7, ("a", "b", "c", "d"))
    np.testing.assert_allclose(model.mean_, again.mean_, atol=1e-12)
    np.testing.assert_allclose(model.explained_variance_, again.explained_variance_)


def test_the_likelihood_of_complete_walkers_gives_the_same_subspace(walkers):
    """EM, asked to by one hidden coefficient in a thousand, against the SVD of the complete walkers."""
    complete = Eigenwalkers(3).fit(walkers)
    hidden = [*walkers[:-1], hide(walkers[-1], [7])]
    found = Eigenwalkers(3, tol=1e-10).fit(hidden)
    overlap = np.linalg.svd(found.components_.reshape(3, -1) @ complete.components_.reshape(3, -1).T)[1]
    assert overlap.min() > 0.995
    np.testing.assert_allclose(found.explained_variance_, complete.explained_variance_, rtol=0.05)
    np.testing.assert_allclose(found.explained_variance_ratio_, complete.explained_variance_ratio_, atol=0.02)


@settings(max_examples=8)
@given(st.integers(0, 1000))
def test_hidden_markers_are_told_from_the_others(seed):
    """Walkers with an arm or leg hidden: what the model says of it is far nearer the truth than the average walker."""
    rng = np.random.default_rng(seed)
    truth = [walker(100 + s) for s in range(14)]
    chains = [[5, 7], [6, 8], [11, 13], [12, 14]]
    hidden = [chains[rng.integers(4)] for _ in range(7)]
    shown = [hide(w, h) for w, h in zip(truth, hidden, strict=False)] + truth[7:]
    model = Eigenwalkers(3).fit(shown)
    ours = average = 0.0
    for w, part, h in zip(truth, shown, hidden, strict=False):
        told = model.inverse_transform(model.transform(part))
        ours += ((told - w.coefficients)[:, h] ** 2).sum()
        average += ((model.mean_ - w.coefficients)[:, h] ** 2).sum()
    assert ours < 0.1 * average


def test_frequency_follows_the_scores(model, walkers):
    """Frequency was made to rise with the stride, of which the scores know."""
    told = model.frequency(model.scores_)
    made = np.array([w.frequency for w in walkers])
    assert np.corrcoef(np.log(told), np.log(made))[0, 1] > 0.9
    assert model.log_frequency_deviation_ < 0.6 * np.log(made).std()


def test_frequency_that_has_nothing_to_do_with_scores_is_left_alone(walkers):
    rng = np.random.default_rng(1)
    loose = [FourierWalker(w.coefficients, np.exp(0.1 * rng.standard_normal())) for w in walkers]
    model = Eigenwalkers(3).fit(loose)
    assert np.linalg.norm(model.log_frequency_weights_) < 0.05
    assert model.log_frequency_deviation_ == pytest.approx(np.log([w.frequency for w in loose]).std(), rel=0.3)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda w: Eigenwalkers().fit(w[:1]), "at least two people, got 1"),
        (lambda w: Eigenwalkers(9).fit(w[:4]), "1 to 3 eigenwalkers"),
        (lambda w: Eigenwalkers().fit(w[:4], ["a"] * 4), "at least two people, got 1"),
        (lambda w: Eigenwalkers().fit(w[:4], ["a"]), "subject"),
        (lambda w: Eigenwalkers().fit([1, 2]), "Markers"),
        (lambda w: Eigenwalkers(1).fit([hide(a, [11]) for a in w]), "left_knee"),
    ],
)
def test_what_makes_no_sense_is_refused(walkers, call, says):
    with pytest.raises(MotionError, match=says):
        call(walkers)


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


def test_in_place_it_is_equation_3_1(model):
    k = np.sqrt(model.explained_variance_) * [1, -1, 0.5]
    walker = motionenv.Walker(model.kind, tuple(k))
    made = made_markers(model, 2.0, 50.0, walker=walker, phase=0.25, overground=False)
    phase = 2 * np.pi * (0.25 + float(model.frequency(k)) * np.arange(100) / 50)
    w = model.inverse_transform(k)
    expected = positions_at(grounded(np.concatenate([w, stride_lengths(w) * model.higher_])), phase)
    np.testing.assert_allclose(made.positions, expected, atol=1e-9)


@pytest.mark.parametrize("name", ["walk/eigenwalkers", "walk/prior"])
def test_strides_of_walks_that_are_made_are_shorter_than_ankles_tell(name):
    """By what `_MADE` says, on average over drawn people."""
    shipped = load(name)
    walkers = [shipped.inverse_transform(shipped.walker(seed).scores) for seed in range(30)]
    ratios = [shipped._gait(w).stride_length / float(stride_lengths(w)) for w in walkers]
    assert np.mean(ratios) == pytest.approx(fourier_model._MADE, abs=0.005)


@pytest.mark.parametrize("speed", [0.8, 1.4])
def test_it_walks_as_fast_as_asked_along_x(model, speed):
    positions = made_markers(model, 6.0, 60.0, seed=1, speed=speed).positions
    pelvis = positions[:, MARKERS.index("pelvis")]
    assert (pelvis[-1] - pelvis[0])[0] / 5.98 == pytest.approx(speed, rel=0.03)
    assert np.abs(np.polyfit(pelvis[:, 0], pelvis[:, 1], 1)[0]) < 0.03


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
        (lambda m: m.synthesize(1.0, speed=2.9, height=0.6), "m/s for a body of 0.60 m, got 2.9"),
        (lambda m: m.synthesize(1.0, walker=m.walker(scores=[1.0] * 9)), "scores"),
        (lambda m: m.sample(0), "n must"),
        (lambda m: m.transform(np.zeros((5, 45))), r"shape \(..., 5, 15, 3\), got \(5, 45\)"),
        (lambda m: m.transform(np.full((5, 15, 3), np.inf)), "finite or NaN"),
        (lambda m: m.inverse_transform([0.0]), r"scores must be finite, of shape \(..., 3\), got \(1,\)"),
        (lambda m: m.frequency([0.0, np.nan, 0.0]), "scores must be finite"),
        (lambda m: Eigenwalkers().sample(1), "not fitted"),
    ],
)
def test_calls_that_make_no_sense_are_refused(model, call, says):
    with pytest.raises(MotionError, match=says):
        call(model)
