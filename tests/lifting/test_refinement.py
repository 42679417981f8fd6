"""Refining from raw points, and what the result says of itself: against differences, dense solves and draws."""

import numpy as np
import pytest
from scipy.stats import norm

from motionenv.errors import GapError, MotionError
from motionenv.lifting import view_geometry as geometry
from motionenv.lifting._parallel_projection import Parallel
from motionenv.lifting.posterior import BAND
from motionenv.lifting.refinement import _BY_MARKER, InitialEstimate, _precision, _Problem, _State, refine
from motionenv.lifting.view_geometry import axes
from motionenv.models.eigenwalkers.extraction import steady_stretch
from motionenv.models.eigenwalkers.fourier_series import columns, positions_at
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.types import MARKERS, Points

FPS, FRAMES = 30.0, 90


@pytest.fixture(scope="module")
def walker(prior):
    """Somebody whom the prior finds likely, (5, 15, 3)."""
    return prior.inverse_transform(0.7 * np.sqrt(prior.explained_variance_) * np.random.default_rng(3).standard_normal(
        len(prior.components_)))  # fmt: skip


def phases(frequency=0.9, phase=0.4):
    return phase + 2 * np.pi * frequency * np.arange(FRAMES) / FPS


def flat(walker, alpha, elevation=0.0, scale=1.0):
    """The picture (frames, 15, 2) of a walker who drifts across it."""
    places = positions_at(walker, phases()) @ geometry.axes(alpha, elevation)[:2].T
    time = np.linspace(-1, 1, FRAMES)[:, None, None]
    return scale * (places + [0.3, -0.1] + time * [1.2, 0.05] + time**2 * [0.1, 0.0])


def near(prior, alpha, **changes):
    values = {"coefficients": prior.mean_, "alpha": alpha + 0.1, "frequency": 0.91, "phase": 0.35} | changes
    return InitialEstimate(**values)


@pytest.mark.parametrize("unknown", [(), ("elevation",), ("elevation", "scale")])
def test_derivatives_are_those_of_differences(prior, unknown):
    rng = np.random.default_rng(0)
    time = np.linspace(-1, 1, 12)
    picture = Parallel(np.polynomial.legendre.legvander(time, 2), 0.3, 100.0, unknown)
    own = 0.1 * rng.standard_normal(len(picture.names))
    problem = _Problem(prior, rng.standard_normal((12, 15, 2)), np.ones((12, 15), bool), picture, time, True)
    state = _State(prior.mean_.reshape(-1)[_BY_MARKER], np.concatenate([[0.7, 0.3, 5.0], own]))
    _, metres = problem.residual(state)
    jacobian = problem.jacobian(state)
    for k in range(225 + len(state.shared)):
        step = np.zeros(225 + len(state.shared))
        step[k] = 1e-6
        ahead, behind = (problem.residual(state.moved(s * step), metres)[0] for s in (1, -1))
        expected = np.moveaxis((behind - ahead) / 2e-6, 1, 0)
        if k < 225:
            np.testing.assert_allclose(jacobian[k // 15, ..., k % 15], expected[k // 15], atol=1e-7)
        else:
            np.testing.assert_allclose(jacobian[..., k - 210], expected, atol=1e-7)


def test_precision_is_the_inverse_of_the_dense_covariance(prior):
    e = prior.components_.reshape(len(prior.components_), -1)
    size = 0.015 * prior.mean_.reshape(-1)
    covariance = (e.T * prior.explained_variance_) @ e + np.outer(size, size)
    covariance += np.diag(np.repeat(prior.noise_.reshape(-1), 3))
    np.testing.assert_allclose(_precision(prior) @ covariance, np.eye(225), atol=1e-6)


def test_a_step_of_the_linear_problem_is_the_closed_form(prior, walker):
    """With view, phase and frequency held, the normal equations are those of Bayesian linear regression."""
    time = np.linspace(-1, 1, FRAMES)
    picture = Parallel(np.ones((FRAMES, 1)), 0.0, 1.0, ())
    places = positions_at(walker, phases()) @ geometry.axes(0.5)[:2].T
    problem = _Problem(prior, places, np.ones((FRAMES, 15), bool), picture, time, False)
    middle, turns = phases().mean(), np.ptp(phases()) / 2
    state = _State(prior.mean_.reshape(-1)[_BY_MARKER], np.array([0.5, middle, turns, 0.0, 0.0]))
    matrix, slope, _ = problem.normal(state, np.full((FRAMES, 15), 1e4))
    found = state.walker + np.linalg.solve(matrix[:225, :225], slope[:225])
    shows = np.einsum("th,ic->tihc", columns(phases()), geometry.axes(0.5)[:2]).reshape(-1, 15)
    design = np.kron(np.eye(15), shows)
    y = places.transpose(1, 0, 2).reshape(-1)
    inverse = _precision(prior)[np.ix_(_BY_MARKER, _BY_MARKER)]
    expected = np.linalg.solve(1e4 * design.T @ design + inverse, 1e4 * design.T @ y + inverse @ state.walker)
    np.testing.assert_allclose(found, expected, atol=1e-8)


@pytest.mark.parametrize("alpha", [-1.2, 0.3, 1.5, 2.8])
def test_an_exact_walk_comes_back(prior, walker, alpha):
    posterior = refine(prior, Points(flat(walker, alpha), FPS, "m"), near(prior, alpha))
    shown = geometry.project(posterior.coefficients - walker, posterior.alpha)
    assert posterior.converged
    assert posterior.alpha == pytest.approx(alpha, abs=4 * posterior.standard_deviation("alpha") + 0.01)
    assert posterior.frequency == pytest.approx(0.9, rel=1e-3)
    assert np.abs(shown[1:]).max() < 0.01
    assert np.sqrt(((posterior.positions - positions_at(walker, phases())) ** 2).mean()) < 0.02


def test_elevation_and_scale_come_back_in_pixels(prior, walker):
    points = Points(flat(walker, 0.6, 0.25, 180.0) * [1.0, -1.0], FPS, "px")
    start = near(prior, 0.6, elevation=0.1, scale=200.0)
    posterior = refine(prior, points, start, unknown=("alpha", "elevation", "scale"))
    assert posterior.elevation == pytest.approx(0.25, abs=0.05)
    assert posterior.scale == pytest.approx(180.0, rel=0.05)
    assert posterior.standard_deviation("scale") < 0.06


def test_planted_outliers_lose_their_weight_and_their_pull(prior, walker):
    rng = np.random.default_rng(1)
    positions = flat(walker, 0.6) + 0.005 * rng.standard_normal((FRAMES, 15, 2))
    clean = refine(prior, Points(positions, FPS, "m"), near(prior, 0.6))
    planted = rng.random((FRAMES, 15)) < 0.05
    positions[planted] += 0.3 + 0.2 * rng.random((planted.sum(), 2))
    posterior = refine(prior, Points(positions, FPS, "m"), near(prior, 0.6))
    plain = refine(prior, Points(positions, FPS, "m"), near(prior, 0.6), robust=False)
    assert posterior.weights[planted].max() < 0.1
    assert np.median(posterior.weights[~planted]) > 0.8
    away = [np.abs(r.positions - clean.positions).max() for r in (posterior, plain)]
    assert away[0] < 0.01
    assert away[0] < 0.3 * away[1]


def test_markers_lost_throughout_are_filled_and_less_sure(prior, walker):
    positions = flat(walker, 0.6) + 0.003 * np.random.default_rng(0).standard_normal((FRAMES, 15, 2))
    lost = [MARKERS.index(n) for n in ("left_wrist", "right_knee", "head")]
    positions[:, lost] = np.nan
    posterior = refine(prior, Points(positions, FPS, "m"), near(prior, 0.6))
    assert np.abs(posterior.positions - positions_at(walker, phases())).max() < 0.1
    assert (posterior.weights[:, lost] == 0).all()
    seen = refine(prior, Points(flat(walker, 0.6), FPS, "m"), near(prior, 0.6))
    assert (posterior.deviations[:, lost].mean(axis=0) > seen.deviations[:, lost].mean(axis=0)).all()


def test_what_does_not_go_together_is_named(prior, walker):
    points, start = Points(flat(walker, 0.6), FPS, "m"), near(prior, 0.6)
    with pytest.raises(MotionError, match="unknown must be"):
        refine(prior, points, start, unknown=("height",))
    with pytest.raises(MotionError, match="drift"):
        refine(prior, points, start, drift=-1)
    with pytest.raises(MotionError, match="InitialEstimate needs"):
        near(prior, np.nan)
    with pytest.raises(GapError, match="strides"):
        refine(prior, Points(points.positions[:30], FPS, "m"), start)
    few = np.array(points.positions)
    few[:, 2:] = np.nan
    with pytest.raises(GapError, match="at least three"):
        refine(prior, Points(few, FPS, "m"), start)


@pytest.mark.slow
def test_a_person_left_out_is_told_within_bounds(cmu_walkers):
    """Raw frames at 30 fps of people that the prior has not seen: direction, depth, and how often bands hold it."""
    kept = [(m, w, p) for m, w, p in cmu_walkers if m.name != "38_02"]
    others = [(w, p) for _, w, p in kept if p != "16"]
    prior = WalkerPrior().fit([w for w, _ in others], [p for _, p in others])
    angles, squares, inside = [], [], []
    for m, w, _ in [k for k in kept if k[2] == "16"][::3]:
        still, phase = in_place(m, w)
        for alpha in np.radians([-60.0, 0.0, 45.0]):
            axes = geometry.axes(alpha)
            start = InitialEstimate(prior.mean_, alpha + 0.1, w.frequency * 1.01, phase + 0.1)
            posterior = refine(prior, Points(still @ axes[:2].T, 30.0, "m"), start)
            off = (posterior.positions - still) @ axes[2]
            deviations = posterior.deviations @ np.abs(axes[2])
            angles.append(np.degrees(posterior.alpha - alpha))
            squares.append((off**2).mean())
            inside.append((np.abs(off) < 1.645 * deviations).mean())
    assert np.abs(angles).mean() < 3.0
    assert np.sqrt(np.mean(squares)) < 0.035
    assert 0.8 < np.mean(inside)


def in_place(markers, walker):
    """Every fourth frame (n, 15, 3) [m] of a walk as on a treadmill, facing x, and the phase of the first of them."""
    positions = markers.positions[steady_stretch(markers)]
    time = (np.arange(len(positions)) - (len(positions) - 1) / 2) / markers.fps
    waves = columns(2 * np.pi * walker.frequency * time)
    way = (time / time[-1])[:, None] ** np.arange(1, 4)
    fitted = np.linalg.lstsq(np.hstack([waves, way]), positions[:, MARKERS.index("pelvis")], rcond=None)[0]
    travel = way @ (fitted[5:] * [1.0, 1.0, 0.0])
    x, y = (travel[-1] - travel[0])[:2] / np.hypot(*(travel[-1] - travel[0])[:2])
    still = (positions - travel[:, None]) @ np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]]).T
    w = np.linalg.lstsq(waves, still.reshape(len(still), -1), rcond=None)[0].reshape(5, 15, 3)
    lead = w[1:3, MARKERS.index("left_ankle"), 0] - w[1:3, MARKERS.index("right_ankle"), 0]
    phase = 2 * np.pi * walker.frequency * time[0] - np.arctan2(lead[0], lead[1])
    return (still + (walker.coefficients[0] - w[0]).mean(axis=0))[::4], phase


@pytest.fixture(scope="module")
def lifted(prior, walker):
    """Lifted from an orthographic picture with noise of 1 cm."""
    places = positions_at(walker, phases()) @ axes(0.6)[:2].T
    noisy = places + 0.01 * np.random.default_rng(2).standard_normal(places.shape)
    return refine(prior, Points(noisy, FPS, "m"), InitialEstimate(prior.mean_, 0.7, 0.91, 0.35))


def test_a_band_holds_nine_tenths():
    assert norm.cdf(BAND) - norm.cdf(-BAND) == pytest.approx(0.9)


def test_positions_are_the_series_in_place(lifted):
    np.testing.assert_allclose(lifted.positions, positions_at(lifted.coefficients, lifted.phases), atol=1e-12)
    assert np.diff(lifted.phases).mean() * FPS / (2 * np.pi) == pytest.approx(lifted.frequency)
    assert lifted.phases[0] == pytest.approx(lifted.phase)


def test_parameters_are_told_by_name(lifted):
    assert lifted.names[:3] == ("alpha", "phase", "turns")
    for i, name in enumerate(lifted.names):
        assert lifted.standard_deviation(name) == pytest.approx(np.sqrt(lifted.parameter_covariance[i, i]))
    with pytest.raises(ValueError, match="not in tuple"):
        lifted.standard_deviation("weather")


def test_deviations_are_those_of_drawn_posteriors(lifted):
    rng = np.random.default_rng(0)
    order = len(lifted._joint)
    draws = np.linalg.cholesky(lifted._joint + 1e-15 * np.eye(order)) @ rng.standard_normal((order, 4000))
    time = np.linspace(-1, 1, FRAMES)[::30]
    middle, turns = lifted.phases.mean(), np.ptp(lifted.phases) / 2
    moved = [
        positions_at(lifted.coefficients + d[:225].reshape(5, 15, 3), middle + d[226] + time * (turns + d[227]))
        for d in draws.T
    ]
    variance = np.var(moved, axis=0) * lifted.inflation[:, None] + lifted.deviation[:, None] ** 2
    np.testing.assert_allclose(lifted.deviations[::30], np.sqrt(variance), rtol=0.1)


def test_depth_is_less_sure_than_what_the_picture_shows(lifted):
    across, _, away = axes(lifted.alpha)
    assert lifted.deviations.shape == (FRAMES, 15, 3)
    assert (lifted.deviations >= lifted.deviation[:, None]).all()
    variance = lifted.deviations**2
    assert np.median(variance @ away**2) > 1.1 * np.median(variance @ across**2)
