"""2D Fourier series of real walks against the 3D series of the same walks, and of known coefficients."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import GapError, MotionError
from motionenv.lifting.fourier_fit import fourier_points
from motionenv.lifting.view_geometry import project, project_markers, turned_to_x
from motionenv.mocap import read, to_markers
from motionenv.models.eigenwalkers.extraction import fourier_walker, steady_stretch
from motionenv.models.eigenwalkers.fourier_series import columns, later
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Markers, Points

TRIALS = ("02/02_01", "07/07_08", "12/12_02", "16/16_15", "35/35_10", "49/49_01")
VIEWS = np.radians(np.arange(0, 181, 30))


@pytest.fixture(scope="module")
def walks(mocap) -> list[tuple[Markers, object]]:
    """Steady walks along x at 30 frames per second, and their 3D series."""
    out = []
    for trial in TRIALS:
        markers = to_markers(read(mocap / "cmu_asfamc" / f"{trial}.amc", fps=120))
        walker = fourier_walker(markers)
        positions = turned_to_x(markers, walker.heading).positions[steady_stretch(markers)][::4]
        out.append((Markers(MARKERS, positions, 30, name=trial), walker))
    return out


def known(seed: int, cycles: float, frequency=0.9) -> tuple[np.ndarray, Points]:
    """Coefficients (5, 15, 2), and the points of their walk across the picture."""
    rng = np.random.default_rng(seed)
    w = np.concatenate([rng.normal(0, 0.5, (1, 15, 2)), rng.normal(0, 0.05, (4, 15, 2))])
    t = np.arange(round(cycles / frequency * 30)) / 30
    return w, Points(np.einsum("th,hmc->tmc", columns(2 * np.pi * frequency * t), w), 30, "m")


def moved(points: Points, shift) -> Points:
    return Points(points.positions + shift, points.fps, points.unit)


@settings(max_examples=25)
@given(st.integers(0, 100), st.floats(1.55, 5), st.floats(0.6, 1.6))
def test_known_series_are_recovered(seed, cycles, frequency):
    w, points = known(seed, cycles + 0.1, frequency=frequency)
    t = np.arange(len(points.positions)) / 30
    drift = np.stack([0.2 + 1.3 * t - 0.05 * t**3, 0.01 * t**2], axis=-1)
    found = fourier_points(moved(points, drift[:, None]))
    assert found.frequency == pytest.approx(frequency, abs=1e-5)
    assert found.cycles == pytest.approx(found.frequency * len(t) / 30)
    np.testing.assert_allclose(found.coefficients[1:], w[1:], atol=1e-4)
    np.testing.assert_allclose(found.coefficients[0] - w[0], np.broadcast_to(drift.mean(0), (15, 2)), atol=1e-4)
    np.testing.assert_allclose(found.drift_at(t), drift - drift.mean(0), atol=1e-4)
    np.testing.assert_allclose(found.positions_at(t), points.upward + drift[:, None], atol=1e-4)
    np.testing.assert_array_equal(found.size, [1, 0, 0])
    assert found.explained > 0.9999


def test_pixels_without_perspective_give_the_same_series(walks):
    for markers, _ in walks[::2]:
        points = project_markers(markers, 0.6, heading=0)
        pixels = Points(points.positions * [250, -250] + [900, 700], 30, "px")
        metres, found = fourier_points(points), fourier_points(pixels)
        assert found.frequency == pytest.approx(metres.frequency, rel=0.01)
        assert np.sqrt(np.mean((found.coefficients / 250 - metres.coefficients)[1:] ** 2)) < 0.005
        t = np.arange(len(pixels.positions)) / 30
        assert np.median(np.abs(found.positions_at(t) - pixels.upward)) < 0.03 * 250
        assert found.size_at(t).mean() == pytest.approx(1)


def test_frequency_and_coefficients_are_those_of_the_3d_series_at_every_view(walks):
    frequency, apart = [], []
    for markers, walker in walks:
        for alpha in VIEWS:
            found = fourier_points(project_markers(markers, alpha, heading=0))
            frequency.append(found.frequency / walker.frequency - 1)
            expected = project(walker.coefficients, alpha)[1:]
            turn = phase_between(found.coefficients, project(walker.coefficients, alpha))
            apart.append(np.sqrt(np.mean((later(found.coefficients, turn)[1:] - expected) ** 2)))
    assert np.abs(frequency).max() < 0.01
    assert np.mean(apart) < 0.0015
    assert np.max(apart) < 0.004


def phase_between(coefficients, wanted) -> np.ndarray:
    """By how much the fundamental of `coefficients` is earlier than that of `wanted`."""
    p, q = coefficients[1].ravel(), coefficients[2].ravel()
    a, b = wanted[1].ravel(), wanted[2].ravel()
    return np.arctan2(p @ b - q @ a, p @ a + q @ b)


def test_gaps_change_little(walks):
    rng = np.random.default_rng(0)
    for markers, walker in walks[::2]:
        for alpha in VIEWS[::3]:
            points = project_markers(markers, alpha, heading=0)
            whole = fourier_points(points)
            positions = points.positions.copy()
            half = round(15 / walker.frequency)
            positions[20 : 20 + half, MARKERS.index("left_knee")] = np.nan
            positions[rng.random(len(positions)) < 0.2] = np.nan
            positions[:, MARKERS.index("right_wrist")] = np.nan
            part = fourier_points(Points(positions, 30, "m"))
            assert part.frequency == pytest.approx(walker.frequency, rel=0.012)
            lost = np.isnan(part.coefficients).any((0, 2))
            assert [MARKERS[m] for m in np.flatnonzero(lost)] == ["right_wrist"]
            assert np.isnan(part.rms[lost]).all()
            off = part.coefficients[:, ~lost] - whole.coefficients[:, ~lost]
            assert np.sqrt(np.mean(off[1:] ** 2)) < 0.006


def test_what_lies_far_off_has_little_say(walks):
    rng = np.random.default_rng(1)
    markers, _ = walks[3]
    points = project_markers(markers, 0.8, heading=0)
    wild = rng.random(points.positions.shape[:2]) < 0.05
    positions = points.positions + np.where(wild[..., None], rng.normal(0, 0.7, points.positions.shape), 0)
    whole, found = fourier_points(points), fourier_points(Points(positions, 30, "m"))
    assert found.frequency == pytest.approx(whole.frequency, rel=0.005)
    assert np.sqrt(np.mean((found.coefficients - whole.coefficients)[1:] ** 2)) < 0.003
    assert np.median(found.weights[wild]) < 0.1
    assert np.median(found.weights[~wild]) == 1


def test_perspective_points_give_the_frequency_too(walks):
    for markers, walker in walks[:3]:
        for alpha in (0.0, 0.9):
            camera = fit_view(markers.positions, alpha)
            points = project_markers(markers, alpha, heading=0, camera=camera)
            assert points.unit == "px"
            assert points.truth is not None
            assert not np.isnan(points.positions).any()
            assert fourier_points(points).frequency == pytest.approx(walker.frequency, rel=0.02)


def test_too_little_is_refused():
    with pytest.raises(GapError, match="too short"):
        fourier_points(Points(known(0, 3)[1].positions[:20], 30, "m"))
    with pytest.raises(GapError, match="strides"):
        fourier_points(known(0, 1.35)[1])
    with pytest.raises(GapError, match="no marker"):
        fourier_points(Points(np.full((100, 15, 2), np.nan), 30, "m"))


@pytest.mark.parametrize(
    ("settings", "says"),
    [({"frequencies": (2.0, 1.0)}, "frequencies"), ({"drift": -1}, "drift"), ({"drift": 1.5}, "drift")],
)
def test_settings_are_checked(settings, says):
    with pytest.raises(MotionError, match=says):
        fourier_points(known(0, 3)[1], **settings)


def test_only_points_make_a_series():
    with pytest.raises(MotionError, match="read_points"):
        fourier_points(np.zeros((100, 15, 2)))
