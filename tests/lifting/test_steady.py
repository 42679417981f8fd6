"""The posterior of a steady walk: against exact walks, a dense solve, people left out and draws of noise."""

import numpy as np
import pytest
from scipy.stats import norm

from motionenv.lifting import find_view, fourier_points, lift, project_markers
from motionenv.lifting.posterior import BAND
from motionenv.lifting.steady import precision_of, steady_walk
from motionenv.lifting.view_geometry import axes
from motionenv.metrics import pelvis_mpjpe
from motionenv.models.eigenwalkers.extraction import steady_stretch
from motionenv.models.eigenwalkers.fourier_series import positions_at
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.types import MARKERS, Markers, Points

FPS, FRAMES, ALPHA = 30.0, 90, 0.6


@pytest.fixture(scope="module")
def walker(prior):
    """Somebody whom the prior finds likely, (5, 15, 3)."""
    return prior.inverse_transform(0.7 * np.sqrt(prior.explained_variance_) * np.random.default_rng(3).standard_normal(
        len(prior.components_)))  # fmt: skip


def seen(walker, noise=0.0, seed=0, scale=1.0):
    """Points of a walker who drifts across the picture."""
    places = positions_at(walker, 0.4 + 2 * np.pi * 0.9 * np.arange(FRAMES) / FPS) @ axes(ALPHA)[:2].T
    time = np.linspace(-1, 1, FRAMES)[:, None, None]
    places = places + [0.3, -0.1] + time * [1.2, 0.05] + time**2 * [0.1, 0.0]
    places = places + noise * np.random.default_rng(seed).standard_normal(places.shape)
    return Points(places, FPS, "m") if scale == 1.0 else Points(scale * places * [1, -1] + 500, FPS, "px")


def known_view(prior, points):
    series = fourier_points(points)
    views = find_view(
        prior, series.coefficients, variance=None, phase="unknown", scale=1.0, offset="unknown", alphas=ALPHA
    )
    return series, views, steady_walk(prior, points, series, views, ())


def test_the_precision_is_the_inverse_of_the_covariance(prior):
    e = np.concatenate([prior.components_, prior.mean_[None]]).reshape(-1, 225)
    spread = np.append(prior.explained_variance_, 0.015**2)
    covariance = (e.T * spread) @ e + np.diag(np.repeat(prior.noise_.reshape(-1), 3))
    np.testing.assert_allclose(precision_of(prior) @ covariance, np.eye(225), atol=1e-6)


def test_given_the_series_the_walker_is_conditional_mean_and_covariance(prior, walker):
    """The same by conditioning the joint normal distribution of walker and series, without any precision."""
    series, views, found = known_view(prior, seen(walker, noise=0.01))
    turn = np.kron(np.array([[1.0]]), np.eye(5))
    phase = -float(views.phase)
    for h in (1, 2):
        c, s = np.cos(h * phase), np.sin(h * phase)
        turn[2 * h - 1 : 2 * h + 1, 2 * h - 1 : 2 * h + 1] = [[c, -s], [s, c]]
    shown = np.einsum("gh,mn,ic->gmihnc", turn, np.eye(15), axes(ALPHA)[:2]).reshape(150, 225)
    e = np.concatenate([prior.components_, prior.mean_[None]]).reshape(-1, 225)
    spread = np.append(prior.explained_variance_, 0.015**2)
    before = (e.T * spread) @ e + np.diag(np.repeat(prior.noise_.reshape(-1), 3))
    noise = np.einsum("mgh,mn,ij->gmihnj", series.covariance + 1e-8 * np.eye(5), np.eye(15), np.eye(2))
    told = series.coefficients.copy()
    told[0] += views.offset
    gain = before @ shown.T @ np.linalg.inv(shown @ before @ shown.T + noise.reshape(150, 150))
    mean = prior.mean_.reshape(-1)
    expected = mean + gain @ (told.reshape(-1) - shown @ mean)
    np.testing.assert_allclose(found.coefficients.reshape(-1), expected, atol=1e-6)
    after = before - gain @ shown @ before
    assert (np.diag(found._joint)[:225] >= np.diag(after) * (1 - 1e-6)).all()  # view and phase aren't sure either


@pytest.mark.parametrize("scale", [1.0, 200.0])
def test_an_exact_picture_of_a_likely_walker_is_met(prior, walker, scale):
    found = lift(seen(walker, scale=scale), prior=prior, method="steady").posterior
    assert np.degrees(abs(found.alpha - ALPHA)) < 5
    assert found.frequency == pytest.approx(0.9, rel=1e-4)
    assert found.scale == pytest.approx(scale, rel=0.1)
    assert pelvis_mpjpe(found.positions, positions_at(walker, found.phases)).mean() < 0.035
    assert found.names == ("alpha", "phase", "turns") + (("scale",) if scale > 1 else ())
    assert found.phases[0] % (2 * np.pi) == pytest.approx(found.phase)


def test_noise_of_the_points_spreads_as_much_as_it_is_said_to(prior, walker):
    """Walkers from many draws of noise, at a known view: they spread by less than the prior's part of the posterior."""
    found = [known_view(prior, seen(walker, 0.03, seed))[2] for seed in range(12)]
    spread = np.std([f.coefficients for f in found], axis=0).reshape(-1)
    told = np.sqrt(np.mean([np.diag(f._joint)[:225] for f in found], axis=0))
    assert (spread < 1.6 * told).mean() > 0.95
    assert np.median(spread / told) > 0.05
    clean = known_view(prior, seen(walker))[2]
    assert (np.diag(clean._joint)[:225] <= told**2 * (1 + 1e-6)).mean() > 0.99


def test_a_marker_never_seen_is_less_sure(prior, walker):
    points = seen(walker, 0.005)
    hidden = points.positions.copy()
    hidden[:, MARKERS.index("left_wrist")] = np.nan
    whole, found = known_view(prior, points)[2], known_view(prior, Points(hidden, FPS, "m"))[2]
    wrist = MARKERS.index("left_wrist")
    assert (found.deviations[:, wrist].mean(axis=0) > whole.deviations[:, wrist].mean(axis=0)).all()
    assert found.weights[:, wrist].max() == 0


@pytest.mark.slow
def test_a_person_left_out_is_told_within_bounds(cmu_walkers):
    """Frames at 30 fps of a person that the prior has not seen: direction, depth, and how often bands hold it."""
    kept = [(m, w, p) for m, w, p in cmu_walkers if m.name != "38_02"]
    others = [(w, p) for _, w, p in kept if p != "16"]
    prior = WalkerPrior().fit([w for w, _ in others], [p for _, p in others])
    angles, errors, inside = [], [], []
    for m, _, _ in [k for k in kept if k[2] == "16"][::3]:
        walk = Markers(MARKERS, m.positions[steady_stretch(m)][::4], m.fps / 4)
        for alpha in np.radians([-60.0, 0.0, 45.0]):
            points = project_markers(walk, alpha)
            lifted = lift(points, prior=prior)
            about = [p - p[:, [MARKERS.index("pelvis")]] for p in (lifted.positions, points.truth.positions)]
            angles.append(np.degrees(lifted.posterior.alpha - alpha))
            errors.append(pelvis_mpjpe(*about).mean())
            inside.append(np.abs(about[0] - about[1]) < lifted.band)
    assert np.abs(angles).mean() < 3.0
    assert np.mean(errors) < 0.035
    assert 0.8 < np.mean(inside) < 0.99


def test_a_band_holds_nine_tenths():
    assert norm.cdf(BAND) - norm.cdf(-BAND) == pytest.approx(0.9)


def test_parameters_are_told_by_name(prior, walker):
    found = lift(seen(walker, 0.01), prior=prior).posterior
    for i, name in enumerate(found.names):
        assert found.standard_deviation(name) == pytest.approx(np.sqrt(found.parameter_covariance[i, i]))
    with pytest.raises(ValueError, match="not in tuple"):
        found.standard_deviation("weather")
