"""Functional principal components between and within people, against the simulated truth and peers."""

import numpy as np
import pytest

from benchmarks.models.multilevel import MultilevelFPCA, evidence, nest
from benchmarks.models.variance_components import effects
from motionenv.errors import GapError, MotionError
from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.types import Cycles

P, M, Q = 32, 3, 4
BETWEEN, WITHIN = np.array([9.0, 4.0, 1.0, 0.5]), np.array([1.0, 2.0, 3.0, 0.5])
NOISE = 0.15
LOADINGS = np.linalg.qr(np.random.default_rng(8).standard_normal((9 * M, Q)))[0].T.reshape(Q, 9, M)


def made(people: int, rng, least: int = 1, most: int = 8, gaps: float = 0.0):
    """Strides (K, P, m) of people, from `least` to `most` of each, their labels, and people's curves."""
    counts = rng.integers(least, most + 1, people)
    who = np.repeat(np.arange(people), counts)
    own = rng.standard_normal((people, Q)) * np.sqrt(BETWEEN)
    scores = own[who] + rng.standard_normal((len(who), Q)) * np.sqrt(WITHIN)
    curves = sampled_basis(P, 5) @ LOADINGS
    values = np.tensordot(scores, curves, axes=1) + NOISE * rng.standard_normal((len(who), P, M))
    start, length = rng.integers(P, size=(len(who), 1, M)), int(gaps * P)
    values[(np.arange(P)[:, None] - start) % P < length] = np.nan
    return values, who, np.tensordot(own, curves, axes=1)


def fitted(values, who, **settings):
    model = MultilevelFPCA(Q, 5, 4, **{"shrinkage": 0.0, "tol": 1e-8, **settings})
    return model.fit(values, subjects=who)


@pytest.fixture(scope="module")
def model():
    values, who, _ = made(300, np.random.default_rng(1), gaps=0.25)
    return fitted(values, who)


def test_variances_of_people_and_strides_are_told_apart_despite_gaps(model):
    assert model.levels_ == ("people", "strides")
    truth = np.stack([BETWEEN, WITHIN])
    curves = sampled_basis(P, 5) @ LOADINGS
    # Variances of each true component at each level: 300 people tell variances within 8 % (one standard error).
    for level, expected in enumerate(truth):
        projected = np.einsum("qpm,jpm->qj", curves, model.components_[level])
        variances = projected**2 @ model.explained_variance_[level]
        np.testing.assert_allclose(variances, expected, rtol=0.25)
    assert model.icc_ == pytest.approx(BETWEEN.sum() / truth.sum(), abs=0.04)
    assert model.variance_ratio_.sum() + model.noise_ratio_ == pytest.approx(1.0)
    pointwise = np.einsum("q,qpm->pm", BETWEEN, curves**2), np.einsum("q,qpm->pm", WITHIN, curves**2)
    np.testing.assert_allclose(model.icc_curve_, pointwise[0] / sum(pointwise), atol=0.12)


def test_complete_balanced_data_agree_with_di_s_moments():
    rng = np.random.default_rng(2)
    values, who, _ = made(400, rng, 4, 4)
    model = fitted(values, who)
    by_person = values.reshape(400, 4, -1)
    rest = by_person - by_person.mean(axis=1, keepdims=True)
    within = np.einsum("psi,psj->ij", rest, rest) / (400 * 3)
    means = by_person.mean(axis=1) - by_person.mean(axis=(0, 1))
    between = means.T @ means / 400 - within / 4
    values_, axes = np.linalg.eigh(between)
    np.testing.assert_allclose(model.explained_variance_[0], values_[::-1][:Q], rtol=0.03)
    for j in range(3):
        assert abs(model.components_[0, j].ravel() @ axes[:, -1 - j]) > 0.99


def test_likelihood_is_that_of_the_dense_normal(model):
    values, who, _ = made(4, np.random.default_rng(3), 2, 3, gaps=0.4)
    loadings = model._loadings().reshape(Q, -1)
    basis, fpca = sampled_basis(P, 4), model.fpca_
    smooth = np.einsum("pj,qj,aj,ab->paqb", basis, basis, fpca.residual_spectrum_, np.eye(M)).reshape(P * M, P * M)
    residual = smooth + np.diag(np.tile(fpca.white_variance_, P))
    between, within = (loadings.T @ covariance @ loadings for covariance in model.covariances_)
    total = np.kron(np.equal.outer(who, who), between) + np.kron(np.eye(len(who)), within + residual)
    flat = (values - model.mean_).ravel()
    seen = np.isfinite(flat)
    root = np.linalg.cholesky(total[np.ix_(seen, seen)])
    white = np.linalg.solve(root, flat[seen])
    expected = -0.5 * white @ white - np.log(np.diag(root)).sum() - 0.5 * len(white) * np.log(2 * np.pi)
    assert model.score(values, subjects=who) * seen.sum() == pytest.approx(expected, rel=1e-8)


def test_people_left_out_are_found_within_their_bands(model):
    values, who, own = made(400, np.random.default_rng(4), gaps=0.5)
    labels, told = model.effects(values, subjects=[f"{w:03d}" for w in who])
    assert labels == tuple(f"{w:03d}" for w in range(400))
    errors = model.curves(told.means[0]) + model.mean_ - own
    loadings = model._loadings()
    sd = np.sqrt(np.einsum("nij,ipm,jpm->npm", told.covariances[0], loadings, loadings))
    inside = np.abs(errors) < 1.645 * sd
    assert inside.mean() == pytest.approx(0.9, abs=0.03)
    # A person's effect is known the better, the more strides there are.
    spread = np.trace(told.covariances[0], axis1=1, axis2=2)
    counts = np.bincount(who)
    assert spread[counts >= 7].mean() < 0.5 * spread[counts == 1].mean()


def test_draws_vary_as_the_model_says(model):
    drawn = model.sample(3000, 2, seed=5)
    assert drawn.shape == (3000, 2, P, M)
    people = np.einsum("kpm,kpm->", drawn[:, 0] - model.mean_, drawn[:, 1] - model.mean_) / 3000
    total = ((drawn - model.mean_) ** 2).sum() / 6000
    assert people / total == pytest.approx(model.variance_ratio_[0], abs=0.03)
    assert total == pytest.approx(model.explained_variance_.sum() / (1 - model.noise_ratio_), rel=0.05)
    smooth = model.sample(3000, 1, seed=5, noise=False)
    assert ((smooth - model.mean_) ** 2).sum() / 3000 == pytest.approx(model.explained_variance_.sum(), rel=0.05)


def test_trials_are_a_level_where_there_are_any():
    rng = np.random.default_rng(6)
    people, trials, strides = 150, 3, 3
    who, which = np.repeat(np.arange(people), trials * strides), np.repeat(np.arange(people * trials), strides)
    scores = 2.0 * rng.standard_normal((people, Q))[who] + rng.standard_normal((people * trials, Q))[which]
    scores += 0.5 * rng.standard_normal((len(who), Q))
    curves = sampled_basis(P, 5) @ LOADINGS
    values = np.tensordot(scores, curves, axes=1) + NOISE * rng.standard_normal((len(who), P, M))
    model = MultilevelFPCA(Q, 5, 4, shrinkage=0.0).fit(values, subjects=who, trials=which)
    assert model.levels_ == ("people", "trials", "strides")
    np.testing.assert_allclose(model.explained_variance_.sum(axis=1) / Q, [4.0, 1.0, 0.25], rtol=0.15)
    with pytest.raises(MotionError, match="tells trials apart: give the trial of each stride with trials="):
        model.effects(values, subjects=who)


def test_few_people_are_shrunk_and_those_left_out_are_the_likelier_for_it():
    rng, gains = np.random.default_rng(7), []
    unseen, whose, _ = made(200, rng)
    for _ in range(4):
        values, who, _ = made(10, rng, 4, 8)
        chosen, raw = fitted(values, who, shrinkage="likelihood"), fitted(values, who)
        assert chosen.shrinkage_ == max(chosen.selection_, key=chosen.selection_.__getitem__)
        gains.append(chosen.score(unseen, subjects=whose) - raw.score(unseen, subjects=whose))
    assert np.mean(gains) > 0


def test_cycles_have_their_people_and_trials():
    values, who, _ = made(20, np.random.default_rng(3), 4, 4)
    trials = np.arange(len(who)) // 2
    names = tuple(f"person {w}" for w in who)
    cycles = Cycles(values, ("a", "b", "c"), np.ones(len(who)), trials, names)
    model = MultilevelFPCA(Q, 5, 4, shrinkage=0.0).fit(cycles)
    assert model.levels_ == ("people", "trials", "strides")
    assert set(model.effects(cycles)[0]) == set(names)
    assert model.score(cycles) == pytest.approx(model.score(cycles[::-1]))  # their order has no effect
    assert model.score(cycles) == pytest.approx(model.score(values, subjects=names, trials=trials))


def test_scikit_learn_clones_it_and_leaves_people_out():
    sklearn = pytest.importorskip("sklearn")
    assert repr(sklearn.base.clone(MultilevelFPCA(3))) == "MultilevelFPCA(n_components=3)"


@pytest.mark.parametrize(
    ("settings", "subjects", "says"),
    [
        ({}, [0, 1, 2, 3], "somebody with two strides"),
        ({}, [0, 0, 0, 0], "at least two people"),
        ({"shrinkage": -1.0}, [0, 0, 1, 1], 'from 0 on or "likelihood", got -1.0'),
        ({"shrinkage": "most"}, [0, 0, 1, 1], "from 0 on or \"likelihood\", got 'most'"),
    ],
)
def test_what_has_no_levels_is_told(settings, subjects, says):
    values, _, _ = made(4, np.random.default_rng(0), 1, 1)
    with pytest.raises(MotionError, match=says):
        MultilevelFPCA(1, 5, **settings).fit(values, subjects=subjects)


def test_strides_without_samples_tell_nothing(model):
    values, who, _ = made(3, np.random.default_rng(1), 2, 3)
    empty = np.concatenate([values, np.full((2, P, M), np.nan)])
    labels = np.r_[who, 0, 9]
    assert model.score(empty, subjects=labels) == pytest.approx(model.score(values, subjects=who))
    _, told = model.effects(empty, subjects=labels)
    np.testing.assert_allclose(told.means[0][-1], model.shift_ * 0, atol=1e-9)
    np.testing.assert_allclose(told.covariances[0][-1], model.covariances_[0], atol=1e-9)
    with pytest.raises(GapError, match="no samples"):
        model.score(np.full((2, P, M), np.nan))


def test_one_level_of_independent_cycles_is_functional_pca(model):
    values, _, _ = made(20, np.random.default_rng(2), 1, 1, gaps=0.3)
    everyone = evidence(model.fpca_, values)
    nesting = nest([str(k) for k in range(len(values))], None)
    halves = np.stack([np.eye(Q) * 0.3, np.eye(Q) * 0.7])
    told = effects(everyone, nesting.parents, halves, np.zeros(Q))
    assert told.log_p == pytest.approx(model.fpca_.score_samples(values).sum())
