"""What a lifted walk says of itself, against series written out and draws from its own covariance."""

import numpy as np
import pytest
from scipy.stats import norm

from motionenv.lifting.posterior import BAND
from motionenv.lifting.refinement import InitialEstimate, refine
from motionenv.lifting.view_geometry import axes
from motionenv.models.eigenwalkers.fourier_series import positions_at
from motionenv.models.registry import load
from motionenv.types import Points

FPS, FRAMES = 30.0, 90
PHASES = 0.4 + 2 * np.pi * 0.9 * np.arange(FRAMES) / FPS


@pytest.fixture(scope="module")
def model():
    return load("walk/prior")


@pytest.fixture(scope="module")
def walker(model):
    """Somebody whom the prior finds likely, (5, 15, 3)."""
    scores = np.random.default_rng(3).standard_normal(len(model.components_))
    return model.inverse_transform(0.7 * np.sqrt(model.explained_variance_) * scores)


@pytest.fixture(scope="module")
def flat(model, walker):
    """Lifted from an orthographic picture with noise of 1 cm."""
    places = positions_at(walker, PHASES) @ axes(0.6)[:2].T
    noisy = places + 0.01 * np.random.default_rng(2).standard_normal(places.shape)
    return refine(model, Points(noisy, FPS, "m"), InitialEstimate(model.mean_, 0.7, 0.91, 0.35))


def test_a_band_holds_nine_tenths():
    assert norm.cdf(BAND) - norm.cdf(-BAND) == pytest.approx(0.9)


def test_positions_are_the_series_in_place(flat):
    np.testing.assert_allclose(flat.positions, positions_at(flat.coefficients, flat.phases), atol=1e-12)
    assert np.diff(flat.phases).mean() * FPS / (2 * np.pi) == pytest.approx(flat.frequency)
    assert flat.phases[0] == pytest.approx(flat.phase)


def test_parameters_are_told_by_name(flat):
    assert flat.names[:3] == ("alpha", "phase", "turns")
    for i, name in enumerate(flat.names):
        assert flat.standard_deviation(name) == pytest.approx(np.sqrt(flat.parameter_covariance[i, i]))
    with pytest.raises(ValueError, match="not in tuple"):
        flat.standard_deviation("weather")


def test_deviations_are_those_of_drawn_posteriors(flat):
    rng = np.random.default_rng(0)
    order = len(flat._joint)
    draws = np.linalg.cholesky(flat._joint + 1e-15 * np.eye(order)) @ rng.standard_normal((order, 4000))
    time = np.linspace(-1, 1, FRAMES)[::30]
    middle, turns = flat.phases.mean(), np.ptp(flat.phases) / 2
    moved = [
        positions_at(flat.coefficients + d[:225].reshape(5, 15, 3), middle + d[226] + time * (turns + d[227]))
        for d in draws.T
    ]
    variance = np.var(moved, axis=0) * flat.inflation[:, None] + flat.deviation[:, None] ** 2
    np.testing.assert_allclose(flat.deviations[::30], np.sqrt(variance), rtol=0.1)


def test_depth_is_less_sure_than_what_the_picture_shows(flat):
    across, _, away = axes(flat.alpha)
    assert flat.deviations.shape == (FRAMES, 15, 3)
    assert (flat.deviations >= flat.deviation[:, None]).all()
    variance = flat.deviations**2
    assert np.median(variance @ away**2) > 1.1 * np.median(variance @ across**2)
