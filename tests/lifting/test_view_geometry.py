"""View angles against SciPy's rotations and a pinhole camera far away, and projections of real walks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv.errors import GapError, MotionError
from motionenv.lifting.view_geometry import axes, depth, project, project_markers, turned_to_x
from motionenv.mocap import read, to_markers
from motionenv.render.cameras import fit_view, look_at
from motionenv.types import MARKERS, Camera, Markers

angles = st.floats(-10, 10)


@given(angles, st.floats(-1.5, 1.5))
def test_axes_are_those_of_a_camera_that_turns_and_then_looks_down(alpha, elevation):
    level = np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0]])  # across x, upwards z, away y
    turned = Rotation.from_euler("z", alpha) * Rotation.from_euler("x", -elevation)
    np.testing.assert_allclose(axes(alpha, elevation), turned.apply(level), atol=1e-12)


def test_from_the_side_one_walks_to_the_right_and_from_the_front_towards_one():
    np.testing.assert_allclose(axes(0.0), [[1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-12)
    across, _, away = axes(np.pi / 2)
    np.testing.assert_allclose(across, [0, 1, 0], atol=1e-12)  # the walker's left is to the right
    np.testing.assert_allclose(away, [-1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(("alpha", "elevation"), [(0.3, 0.0), (-2.0, 0.4), (2.5, -0.7)])
def test_a_camera_far_away_sees_what_is_projected_and_how_far_it_is(alpha, elevation):
    w = np.random.default_rng(0).standard_normal((5, 15, 3))
    level = np.cos(elevation)
    eye = 1e5 * np.array([np.sin(alpha) * level, -np.cos(alpha) * level, np.sin(elevation)])
    camera = look_at(eye, (0, 0, 0))
    pixels, away = camera.project(w)
    middle, distance = camera.project(np.zeros(3))
    seen = (pixels - middle) * distance / camera.K[0, 0] * [1, -1]
    np.testing.assert_allclose(project(w, alpha, elevation), seen, atol=1e-3)
    np.testing.assert_allclose(depth(w, alpha, elevation), away - distance, atol=1e-3)


def test_views_broadcast_with_walkers_and_nothing_is_lost():
    w = np.random.default_rng(1).standard_normal((4, 5, 15, 3))
    alpha, elevation = np.array([0.0, 1.0, -2.0, 4.0]), 0.3
    flat, away = project(w, alpha, elevation), depth(w, alpha, elevation)
    assert (flat.shape, away.shape) == ((4, 5, 15, 2), (4, 5, 15))
    np.testing.assert_allclose(project(w[2], alpha[2], elevation), flat[2], atol=1e-12)
    np.testing.assert_allclose((flat**2).sum(-1) + away**2, (w**2).sum(-1))


@pytest.fixture(scope="module")
def markers(mocap) -> Markers:
    return to_markers(read(mocap / "cmu_asfamc" / "07" / "07_01.amc", fps=120))


def test_projections_have_the_axes_of_the_geometry(markers):
    side, front = (project_markers(markers, a) for a in (0.0, np.pi / 2))
    left, right = MARKERS.index("left_hip"), MARKERS.index("right_hip")
    assert side.positions[-1, 0, 0] - side.positions[0, 0, 0] > 2  # walks to the right
    assert (front.positions[:, left, 0] > front.positions[:, right, 0]).all()
    np.testing.assert_allclose(side.positions[..., 1], markers.positions[..., 2], atol=1e-12)
    np.testing.assert_allclose(side.positions[..., 0], side.truth.positions[..., 0])


@pytest.mark.parametrize("heading", [0.7, -2.5])
def test_whither_somebody_walked_is_told_and_turned_to_x(markers, heading):
    c, s = np.cos(heading), np.sin(heading)
    turned = markers.positions @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    there = Markers(MARKERS, turned, markers.fps)
    np.testing.assert_allclose(turned_to_x(there).positions, turned_to_x(markers).positions, atol=1e-6)
    np.testing.assert_allclose(turned_to_x(there, heading).positions, markers.positions, atol=1e-9)
    way = np.diff(turned_to_x(there).positions[[0, -1], MARKERS.index("pelvis")], axis=0)[0]
    assert way[0] > 2
    assert abs(way[1]) < 0.1 * way[0]
    np.testing.assert_array_equal(turned_to_x(there, 0.0).positions, turned)


def test_pixels_are_those_of_the_camera_and_what_it_does_not_hold_is_a_gap(markers):
    camera = fit_view(markers.positions[:100], 0.4, width=320, height=240)
    points = project_markers(markers, 0.4, camera=camera, heading=0.0)
    assert points.unit == "px"
    expected, depth = camera.project(markers.positions)
    column, row = expected[..., 0], expected[..., 1]
    held = (column >= -0.5) & (column <= 319.5) & (row >= -0.5) & (row <= 239.5) & (depth > 0)
    assert 0.2 < held.mean() < 0.9
    np.testing.assert_array_equal(np.isfinite(points.positions).all(-1), held)
    np.testing.assert_allclose(points.positions[held], expected[held])
    np.testing.assert_array_equal(points.truth.positions, markers.positions)


def test_a_picture_begins_half_a_pixel_before_the_centre_of_its_first(markers):
    camera = fit_view(markers.positions, 0.4, width=320, height=240)
    column = camera.project(markers.positions[0, 0])[0][0]
    for lands, seen in ((-0.4, True), (-0.6, False), (319.4, True), (319.6, False)):
        shift = np.zeros((3, 3))
        shift[0, 2] = lands - column
        moved = Camera(camera.K + shift, camera.R, camera.t, 320, 240)
        points = project_markers(markers, 0.4, camera=moved, heading=0.0)
        assert np.isfinite(points.positions[0, 0]).all() == seen, lands


def test_only_walks_of_the_15_markers_are_projected_at_angles_there_are():
    with pytest.raises(MotionError, match=r"one sequence of the 15 markers: make it with .*to_markers"):
        project_markers(np.zeros((100, 15, 3)), 0.0)
    still = Markers(MARKERS, np.zeros((100, 15, 3)), 30)
    with pytest.raises(MotionError, match="alpha must be finite .*, got nan"):
        project_markers(still, np.nan)
    with pytest.raises(MotionError, match=r"elevation within ±π/2 rad, got 0\.0 and 1\.6"):
        project_markers(still, 0.0, elevation=1.6)
    with pytest.raises(MotionError, match="heading must be a finite angle in radians, got inf"):
        project_markers(still, 0.0, heading=np.inf)
    with pytest.raises(GapError, match="pelvis"):
        project_markers(Markers(MARKERS, np.full((100, 15, 3), np.nan), 30), 0.0)
