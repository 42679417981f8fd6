"""What a lifted walk says of itself, against series written out and draws from its own covariance."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from motionenv.lifting.posterior import BAND
from motionenv.lifting.refinement import Start, refine
from motionenv.lifting.view_geometry import axes
from motionenv.models.eigenwalkers.fourier_series import positions_at
from motionenv.models.registry import load
from motionenv.render.cameras import fit_view, project
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
    return refine(model, Points(noisy, FPS, "m"), Start(model.mean_, 0.7, 0.91, 0.35))


@pytest.fixture(scope="module")
def before_a_camera(model, walker):
    """The walk over ground, heading 0.8 rad, and what is told of it from a camera."""
    places = positions_at(walker, PHASES)
    places[..., 0] += np.linspace(-1.8, 1.8, FRAMES)[:, None]
    s, c = np.sin(0.8), np.cos(0.8)
    world = places @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    camera = fit_view(world, 0.5, elevation=0.15)
    points = Points(project(world, camera)[0], FPS, "px")
    return world, refine(model, points, Start(model.mean_, -0.2, 0.91, 0.35), camera=camera)


def test_a_band_holds_nine_tenths():
    assert norm.cdf(BAND) - norm.cdf(-BAND) == pytest.approx(0.9)


def test_without_a_camera_positions_are_the_series_in_place(flat):
    assert flat.heading == 0.0
    np.testing.assert_allclose(flat.positions, positions_at(flat.coefficients, flat.phases), atol=1e-12)
    assert np.diff(flat.phases).mean() * FPS / (2 * np.pi) == pytest.approx(flat.frequency)
    assert flat.phases[0] == pytest.approx(flat.phase)


def test_with_a_camera_the_walker_stands_on_the_path_and_faces_along_the_heading(before_a_camera):
    world, posterior = before_a_camera
    assert posterior.heading == pytest.approx(0.8, abs=0.02)
    c, s = np.cos(posterior.heading), np.sin(posterior.heading)
    local = (posterior.positions - posterior.path[:, None]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(local, positions_at(posterior.coefficients, posterior.phases), atol=1e-9)
    assert np.abs(posterior.positions - world).max() < 0.15


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


def test_depth_is_less_sure_than_what_the_picture_shows(flat, before_a_camera):
    """Along the line of sight, and in the world, where the distance to the camera is what is least sure."""
    across, _, away = axes(flat.alpha)
    assert flat.deviations.shape == (FRAMES, 15, 3)
    assert (flat.deviations >= flat.deviation[:, None]).all()
    variance = flat.deviations**2
    assert np.median(variance @ away**2) > 1.1 * np.median(variance @ across**2)
    world, posterior = before_a_camera
    assert (np.abs(posterior.positions - world) < BAND * posterior.deviations).mean() > 0.85


def test_how_unsure_the_heading_is_moves_markers_as_turning_does(before_a_camera):
    """All other parameters taken as known: deviations are differences of positions by the view angle."""
    _, posterior = before_a_camera
    joint = np.zeros_like(posterior._joint)
    joint[225, 225] = 0.02**2
    alone = replace(posterior, _joint=joint, inflation=np.ones(15), deviation=np.zeros(15))
    turned = [replace(posterior, alpha=posterior.alpha + h).positions for h in (-1e-5, 1e-5)]
    slope = (turned[1] - turned[0]) / 2e-5
    np.testing.assert_allclose(alone.deviations, 0.02 * np.abs(slope), atol=1e-7)
