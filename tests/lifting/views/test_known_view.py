"""Approaches I and II of paper B against dense matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv.errors import ModelError, MotionError
from motionenv.lifting.view_geometry import axes, depth, project
from motionenv.lifting.views.known_view import least_squares, maximum_a_posteriori
from motionenv.models.eigenwalkers.fourier_series import mirrored
from motionenv.models.registry import load
from tests.lifting.walkers import HIDDEN, drawn


@pytest.fixture(scope="module")
def eigenwalkers():
    return load("walk/eigenwalkers")


def dense(model, w2, alpha, elevation, noise, n, prior: bool):
    """Mean of the scores with C(α) as a matrix of 150 × 225."""
    c = np.kron(np.eye(75), axes(alpha, elevation)[:2])
    y, rows = w2.reshape(-1), ~np.isnan(w2.reshape(-1))
    e = (c @ model.components_[:n].reshape(n, -1).T)[rows]
    rest = (y - c @ model.mean_.reshape(-1))[rows]
    w = np.diag(1 / np.repeat(noise.reshape(-1), 2)[rows])
    if not prior:
        return np.linalg.lstsq(e, rest, rcond=None)[0]
    return np.linalg.solve(np.diag(1 / model.explained_variance_[:n]) + e.T @ w @ e, e.T @ w @ rest)


@pytest.mark.parametrize("hidden", [[], HIDDEN])
@pytest.mark.parametrize("elevation", [0.0, 0.4])
@pytest.mark.parametrize("how", ["ls", "map", "own noise", "noisy"])
def test_scores_are_those_of_dense_matrices(prior, how, elevation, hidden):
    alpha, n = np.array([0.3, -2.0, 0.3]), 8
    w2 = project(drawn(prior, 3), alpha, elevation)
    w2[1:, :, hidden] = np.nan
    noise = prior.noise_ if how == "own noise" else np.full((5, 15), 70e-6)
    measurement = np.linspace(0, 1e-3, 75).reshape(5, 15) * (how == "noisy")
    if how == "ls":
        found = least_squares(prior, w2, alpha, elevation=elevation, n_components=n)
    else:
        variance = None if how == "own noise" else 70e-6
        given = {"variance": variance, "n_components": n, "measurement": measurement}
        found = maximum_a_posteriori(prior, w2, alpha, elevation=elevation, **given)
    for i in range(3):
        mean = dense(prior, w2[i], alpha[i], elevation, noise + measurement, n, how != "ls")
        np.testing.assert_allclose(found.scores[i], mean, atol=1e-11)
    told = prior.mean_ + np.tensordot(found.scores, prior.components_[:n], 1)
    np.testing.assert_allclose(found.depth, depth(told, alpha, elevation), atol=1e-12)


def test_what_was_measured_is_kept_and_the_rest_filled(prior):
    alpha, elevation = 1.1, 0.2
    w2 = project(drawn(prior, 2), alpha, elevation)
    w2[0][:, HIDDEN] = np.nan
    found = maximum_a_posteriori(prior, w2, alpha, variance=None, elevation=elevation)
    told = prior.inverse_transform(found.scores)
    shown = np.where(np.isnan(w2), project(told, alpha, elevation), w2)
    np.testing.assert_allclose(project(found.coefficients, alpha, elevation), shown, atol=1e-12)
    np.testing.assert_allclose(depth(found.coefficients, alpha, elevation), depth(told, alpha, elevation), atol=1e-12)
    np.testing.assert_array_equal(found.seen[0], ~np.isin(np.arange(15), HIDDEN))


@pytest.mark.parametrize("solve", [least_squares, maximum_a_posteriori])
def test_members_of_the_model_are_recovered(eigenwalkers, solve):
    walkers = drawn(eigenwalkers, 5, rest=0.0)
    alpha = np.linspace(-3, 3, 7)
    w2 = project(walkers[:, None], alpha)
    given = {} if solve is least_squares else {"variance": 1e-12}
    found = solve(eigenwalkers, w2, alpha, **given)
    assert found.coefficients.shape == (5, 7, 5, 15, 3)
    np.testing.assert_allclose(found.coefficients, np.repeat(walkers[:, None], 7, axis=1), atol=1e-6)


def test_one_sequence_or_many_in_any_order(prior):
    alpha = np.random.default_rng(0).uniform(-3, 3, (4, 3))
    w2 = project(drawn(prior, 4)[:, None], alpha)
    w2[2, 1][:, HIDDEN] = np.nan
    w2[3, 1][:, HIDDEN[:1]] = np.nan
    whole = maximum_a_posteriori(prior, w2, alpha)
    for i in np.ndindex(4, 3):
        alone = maximum_a_posteriori(prior, w2[i], alpha[i])
        assert alone.scores.shape == (20,)
        np.testing.assert_allclose(whole.scores[i], alone.scores, atol=1e-12)
        np.testing.assert_allclose(whole.coefficients[i], alone.coefficients, atol=1e-12)


@given(alpha=st.floats(-np.pi, np.pi), elevation=st.floats(-0.3, 0.8), seed=st.integers(0, 2**32))
def test_a_mirror_image_is_lifted_to_the_mirror_image(alpha, elevation, seed):
    """The prior is alike for left and right: a mirror in the plane y = 0 makes α into π - α, and turns the picture."""
    prior = load("walk/prior")
    w = drawn(prior, 1, seed)[0]
    one = maximum_a_posteriori(prior, project(w, alpha, elevation), alpha, variance=None, elevation=elevation)
    turned = project(mirrored(w), np.pi - alpha, elevation)
    other = maximum_a_posteriori(prior, turned, np.pi - alpha, variance=None, elevation=elevation)
    np.testing.assert_allclose(mirrored(one.coefficients), other.coefficients, atol=1e-6)


@given(alpha=st.floats(-np.pi, np.pi), seed=st.integers(0, 2**32))
def test_the_posterior_mode_is_a_minimum(alpha, seed):
    """Of eq. 3.14: no step in any score lowers it."""
    model = load("walk/eigenwalkers")
    w2 = project(drawn(model, 1, seed)[0], alpha)

    def cost(k):
        rest = w2 - project(model.inverse_transform(k), alpha)
        return (rest**2).sum(axis=(-3, -2, -1)) / 140e-6 + (k**2 / (2 * model.explained_variance_)).sum(axis=-1)

    best = maximum_a_posteriori(model, w2, alpha).scores
    for step in (1e-4, -1e-4):
        assert (cost(best + step * np.eye(len(best))) > cost(best)).all()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"w2": np.zeros((5, 15, 3))}, "shape"),
        ({"w2": np.zeros((0, 5, 15, 2))}, "at least one"),
        ({"w2": "points"}, "numbers"),
        ({"w2": np.full((5, 15, 2), np.inf)}, "infinite"),
        ({"w2": np.full((5, 15, 2), np.nan)}, "without any marker"),
        ({"w2": np.where(np.arange(2) == 0, np.nan, np.zeros((5, 15, 2)))}, "some NaN"),
        ({"alpha": np.nan}, "alpha must be finite"),
        ({"alpha": "left"}, "alpha must be numbers"),
        ({"alpha": np.zeros(3), "w2": np.zeros((2, 5, 15, 2))}, "alpha"),
        ({"elevation": np.inf}, "elevation"),
        ({"n_components": 0}, "n_components"),
        ({"n_components": 99}, "n_components"),
        ({"variance": 0.0}, "variance"),
        ({"variance": np.nan}, "variance"),
        ({"variance": "70 mm²"}, "variance"),
        ({"measurement": -1e-6}, "measurement"),
        ({"measurement": np.zeros(3)}, "measurement"),
    ],
)
def test_bad_input_is_named(prior, change, words):
    given = {"w2": np.zeros((5, 15, 2)), "alpha": 0.0} | change
    with pytest.raises(MotionError, match=words):
        maximum_a_posteriori(prior, given.pop("w2"), given.pop("alpha"), **given)


def test_noise_that_the_model_does_not_know_is_asked_for(eigenwalkers):
    with pytest.raises(ModelError, match="variance"):
        maximum_a_posteriori(eigenwalkers, np.zeros((5, 15, 2)), 0.0, variance=None)


def test_least_squares_says_when_markers_do_not_suffice(prior):
    w2 = np.full((5, 15, 2), np.nan)
    w2[:, :1] = 0.0
    with pytest.raises(MotionError, match="1 markers don't determine 20 components"):
        least_squares(prior, w2, 0.3)
    assert np.isfinite(maximum_a_posteriori(prior, w2, 0.3).coefficients).all()
