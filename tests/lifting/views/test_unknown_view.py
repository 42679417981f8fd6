"""The view found against brute force, dense grids and a general optimiser."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares as optimise

from motionenv.errors import ModelError, MotionError
from motionenv.lifting.view_geometry import axes, project
from motionenv.lifting.views.known_view import least_squares, maximum_a_posteriori
from motionenv.lifting.views.unknown_view import Views, find_view
from motionenv.models.eigenwalkers.fourier_series import later, mirrored
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.registry import load
from tests.lifting.walkers import HIDDEN, drawn


def apart(a, b) -> np.ndarray:
    """How far apart angles are, around the circle."""
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi)


def cost(model, w2, scores, alpha, elevation=0.0, noise=70e-6, approach="map") -> np.ndarray:
    """Eqs. 4.5 and 4.6 as they are written."""
    rest = w2 - project(model.inverse_transform(scores), alpha, elevation)
    misfit = np.nansum(rest**2 / (2 * np.broadcast_to(noise, (5, 15))[..., None]), axis=(-3, -2, -1))
    return misfit + (scores**2 / (2 * model.explained_variance_)).sum(axis=-1) * (approach == "map")


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [[], HIDDEN])
@pytest.mark.parametrize(("approach", "variance"), [("map", 70e-6), ("map", None), ("ls", 70e-6)])
def test_no_angle_of_a_dense_grid_is_better(prior, approach, variance, hidden):
    """The whole circle by 0.01 degrees through the closed forms, which test_known.py checks; all its minima found."""
    grid = np.radians(np.arange(-18000, 18000) / 100)
    noise = prior.noise_ if variance is None else variance
    w2 = project(drawn(prior, 2), np.array([0.4, -2.5]))
    w2[:, :, hidden] = np.nan
    found = find_view(prior, w2, approach=approach, variance=variance)
    for i in range(2):
        solve = {"map": maximum_a_posteriori, "ls": least_squares}[approach]
        scores = solve(prior, w2[i], grid, **({"variance": variance} if approach == "map" else {})).scores
        j = cost(prior, w2[i], scores, grid, noise=noise, approach=approach)
        assert found.objective[i] <= j.min() + 1e-9
        minima = grid[(j < np.roll(j, 1)) & (j <= np.roll(j, -1))]
        others = found.alternatives.alpha[i]
        told = np.append(others[np.isfinite(others)], found.alpha[i])
        assert len(told) == len(minima)
        assert (apart(minima[:, None], told).min(axis=1) < np.radians(0.01)).all()
        at = cost(prior, w2[i], found.scores[i], found.alpha[i], noise=noise, approach=approach)
        assert found.objective[i] == pytest.approx(at, rel=1e-9)


@pytest.mark.parametrize("approach", ["map", "ls"])
def test_a_general_optimiser_cannot_improve(prior, approach):
    """scipy.optimize.least_squares of eqs. 4.5 and 4.6 over angle and scores together, with C(α) a matrix."""
    w2 = project(drawn(prior, 3), np.array([0.2, 1.5, -2.9]))
    found = find_view(prior, w2, approach=approach)
    e, mean = prior.components_.reshape(20, -1), prior.mean_.reshape(-1)

    def rest(x, y):
        away = (y - np.kron(np.eye(75), axes(x[0])[:2]) @ (mean + x[1:] @ e)) / np.sqrt(70e-6)
        return np.append(away, x[1:] / np.sqrt(prior.explained_variance_) * (approach == "map"))

    for i in range(3):
        start = np.append(found.alpha[i] + 0.05, found.scores[i])
        told = optimise(rest, start, args=(w2[i].reshape(-1),), xtol=1e-14, ftol=1e-14, gtol=1e-12)
        assert apart(told.x[0], found.alpha[i]) < 1e-6
        np.testing.assert_allclose(told.x[1:], found.scores[i], atol=1e-6)
        assert found.objective[i] <= told.cost + 1e-9


def test_minima_are_exact_to_a_thousand_millionth_of_a_radian(prior):
    """The cost by trigonometric interpolation through 1024 angles, an analytic function of α, has its minimum there."""
    n = 1024
    grid = np.arange(n) * 2 * np.pi / n
    w2 = project(drawn(prior, 5), np.array([0.0, 0.5, 1.6, 2.6, -1.0]))
    found = find_view(prior, w2)
    for i in range(5):
        j = cost(prior, w2[i], maximum_a_posteriori(prior, w2[i], grid).scores, grid)
        wave, k = np.fft.rfft(j) / n, np.arange(n // 2 + 1)
        x = found.alpha[i]
        first, second = (np.real((2 * wave * (1j * k) ** d * np.exp(1j * k * x)).sum()) for d in (1, 2))
        assert abs(first / second) < 1e-9
        assert found.alpha_deviation[i] == pytest.approx(second**-0.5, rel=1e-6)


@pytest.mark.parametrize("approach", ["map", "ls"])
def test_members_of_the_model_are_recovered(approach):
    model = load("walk/eigenwalkers")
    alpha = np.linspace(-3.1, 3.1, 9)
    walkers = drawn(model, 2, rest=0.0)
    found = find_view(model, project(walkers[:, None], alpha), approach=approach, variance=1e-14)
    assert apart(found.alpha, alpha).max() < 1e-7
    np.testing.assert_allclose(model.inverse_transform(found.scores), np.repeat(walkers[:, None], 9, 1), atol=1e-6)


def test_everything_unknown_is_recovered_without_noise():
    model = load("walk/eigenwalkers")
    rng = np.random.default_rng(3)
    walkers = drawn(model, 6, 2, rest=0.0)
    alpha, elevation = rng.uniform(-3, 3, 6), rng.uniform(0.05, 0.7, 6)
    phase, scale = rng.uniform(-3, 3, 6), rng.uniform(100, 600, 6)
    w2 = later(project(walkers, alpha, elevation), -phase) * scale[:, None, None, None]
    w2[:, 0] += rng.uniform(-500, 500, (6, 1, 2))
    unknown = {"phase": "unknown", "elevation": "unknown", "scale": "unknown", "offset": "unknown"}
    found = find_view(model, w2, variance=1e-12, **unknown)
    assert apart(found.alpha, alpha).max() < 1e-4
    assert apart(found.phase, phase).max() < 1e-4
    np.testing.assert_allclose(found.elevation, elevation, atol=1e-4)
    np.testing.assert_allclose(found.scale, scale, rtol=1e-4)
    np.testing.assert_allclose(found.aligned(w2), project(walkers, alpha, elevation), atol=1e-4)


@pytest.mark.parametrize("hidden", [[], HIDDEN])
def test_no_neighbour_in_any_unknown_is_better(prior, hidden):
    """The objective as written, with phase, elevation, scale and offset beside angle and scores, is least there."""
    w2 = 300 * later(project(drawn(prior, 1)[0], 0.8, 0.2), 1.0)
    w2[0] += [200.0, -90.0]
    w2[:, hidden] = np.nan
    unknown = {"phase": "unknown", "elevation": "unknown", "scale": "unknown", "offset": "unknown"}
    found = find_view(prior, w2, variance=None, **unknown)
    numbers = 10 * (15 - len(hidden)) - 2

    def objective(x):
        y = later(w2 * x[3], x[2])
        y[0] += x[4:6]
        return cost(prior, y, x[6:], x[0], x[1], prior.noise_) - numbers * np.log(x[3])

    best = np.concatenate([[found.alpha, found.elevation, found.phase, 1 / found.scale], found.offset, found.scores])
    assert objective(best) == pytest.approx(found.objective, rel=1e-9)
    size = np.concatenate([[1e-3, 1e-3, 1e-3, 1e-3 / found.scale], np.full(22, 1e-3)])
    steps = np.random.default_rng(0).uniform(-1, 1, (500, 26)) * size
    assert min(objective(best + step) for step in steps) > found.objective
    gradient = [(objective(best + s) - objective(best - s)) / 2 for s in np.diag(1e-2 * size)]
    assert np.abs(gradient).max() < 1e-4


def test_phase_and_elevation_on_a_dense_grid(prior):
    """Two angles at a time through the search for one, which the tests above check."""
    w2 = later(project(drawn(prior, 1)[0], -0.7, 0.3), 2.0)
    both = find_view(prior, w2, phase="unknown", elevation=0.3)
    alone = find_view(prior, np.array([later(w2, p) for p in np.radians(np.arange(360))]), elevation=0.3)
    assert both.objective <= alone.objective.min() + 1e-9
    assert alone.objective.min() == pytest.approx(both.objective, rel=1e-3)
    assert apart(np.radians(alone.objective.argmin()), both.phase) < np.radians(1)
    up = np.radians(np.arange(-15, 45.5, 0.5))
    steep = find_view(prior, w2, phase=float(both.phase), elevation="unknown")
    each = [find_view(prior, w2, phase=float(both.phase), elevation=e).objective for e in up]
    assert steep.objective <= min(each) + 1e-9
    assert abs(up[np.argmin(each)] - steep.elevation) < np.radians(0.5)


def test_the_estimate_at_a_view_is_that_of_a_known_view(prior):
    w2 = 250 * later(project(drawn(prior, 4), 0.5), np.full(4, -1.0))
    w2[:2, :, HIDDEN] = np.nan
    w2[:, 0] -= 50.0
    found = find_view(prior, w2, variance=None, phase="unknown", scale="unknown", offset="unknown")
    told = maximum_a_posteriori(prior, found.aligned(w2), found.alpha, variance=None)
    np.testing.assert_allclose(told.scores, found.scores, atol=1e-10)


def test_a_range_of_angles_is_kept_to(prior):
    """The paper's own 0 to 180 degrees; where the best lies outside, the range's best is told, at its end or within."""
    w2 = project(drawn(prior, 2), np.array([1.0, -1.0]))
    whole, half = find_view(prior, w2), find_view(prior, w2, alphas=(0.0, np.pi))
    assert (half.alpha >= 0).all()
    assert half.alpha[0] == pytest.approx(whole.alpha[0], abs=1e-9)
    assert half.objective[1] > whole.objective[1]
    flat = find_view(prior, project(drawn(prior, 1)[0], 0.3, 0.6), elevation=(-0.1, 0.2))
    assert flat.elevation == pytest.approx(0.2)


def test_alternatives_are_told_in_order(prior):
    found = find_view(prior, project(drawn(prior, 30), np.linspace(-3, 3, 30)), phase="unknown")
    assert isinstance(found.alternatives, Views)
    all_of_them = np.concatenate([found.objective[:, None], found.alternatives.objective], axis=1)
    there = np.isfinite(all_of_them)
    assert (np.diff(all_of_them, axis=1)[there[:, 1:]] >= 0).all()
    assert (there[:, :-1] >= there[:, 1:]).all()
    assert there[:, 1].all()  # half a stride later, from the other side
    np.testing.assert_array_equal(np.isnan(found.alternatives.scores[..., 0]), ~there[:, 1:])


def test_a_walker_without_left_and_right_looks_alike_from_front_and_back():
    """A plank of markers on one vertical line: from α and π - α the picture differs by its sign across alone."""
    model = load("walk/prior")
    w2 = np.zeros((5, 15, 2))
    w2[0, :, 1] = model.mean_[0, :, 2]
    found = find_view(model, w2)
    assert (found.alternatives.objective - found.objective).min() < 1e-6


@settings(max_examples=40)
@given(alpha=st.floats(-np.pi, np.pi), elevation=st.floats(-0.2, 0.7), seed=st.integers(0, 2**32))
def test_a_mirror_image_is_seen_from_the_mirrored_view(alpha, elevation, seed):
    prior = load("walk/prior")
    w = drawn(prior, 1, seed)[0]
    one = find_view(prior, project(w, alpha, elevation), variance=None, elevation=elevation)
    turned = project(mirrored(w), np.pi - alpha, elevation)
    other = find_view(prior, turned, variance=None, elevation=elevation)
    assert apart(one.alpha, np.pi - other.alpha) < 1e-6
    assert one.objective == pytest.approx(other.objective, rel=1e-6)


@settings(max_examples=40)
@given(turn=st.floats(-10, 10), size=st.floats(1e-3, 1e3), seed=st.integers(0, 2**32))
def test_phase_and_scale_go_with_the_sequence(turn, size, seed):
    prior = load("walk/prior")
    w2 = project(drawn(prior, 1, seed)[0], 0.6)
    one = find_view(prior, w2, phase="unknown", scale="unknown")
    other = find_view(prior, size * later(w2, turn), phase="unknown", scale="unknown")
    assert apart(one.alpha, other.alpha) < 1e-6
    assert apart(one.phase, other.phase + turn) < 1e-6
    assert other.scale == pytest.approx(size * one.scale, rel=1e-6)


def test_noise_that_depends_on_phase_cannot_tell_it(prior):
    uneven = WalkerPrior()
    vars(uneven).update(vars(prior))
    uneven.noise_ = prior.noise_ * np.array([1, 2, 1, 1, 1.0])[:, None]
    with pytest.raises(ModelError, match="sine and cosine"):
        find_view(uneven, np.zeros((5, 15, 2)), variance=None, phase="unknown")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"w2": np.zeros((5, 15))}, "shape"),
        ({"w2": np.full((5, 15, 2), np.nan)}, "without any marker"),
        ({"w2": np.full((5, 15, 2), np.inf)}, "infinite"),
        ({"approach": "mle"}, "approach"),
        ({"offset": 3.0}, "offset"),
        ({"phase": "none"}, "phase must be numbers"),
        ({"phase": np.nan}, "phase must be finite"),
        ({"phase": np.zeros(3)}, "phase"),
        ({"elevation": "high"}, "elevation"),
        ({"elevation": (0.5, 0.1)}, "low < high"),
        ({"alphas": (0.5, 0.5)}, "low < high"),
        ({"alphas": (0.0, np.inf)}, "alphas"),
        ({"scale": 0.0}, "scale"),
        ({"scale": "big"}, "scale"),
        ({"variance": -1.0}, "variance"),
        ({"n_components": 2.5}, "n_components"),
    ],
)
def test_bad_input_is_named(prior, change, words):
    given = {"w2": np.zeros((5, 15, 2))} | change
    with pytest.raises(MotionError, match=words):
        find_view(prior, given.pop("w2"), **given)


def test_least_squares_says_when_markers_do_not_suffice(prior):
    w2 = np.full((5, 15, 2), np.nan)
    w2[:, :1] = 0.0
    with pytest.raises(MotionError, match="1 markers don't determine 20 components"):
        find_view(prior, w2, approach="ls")
