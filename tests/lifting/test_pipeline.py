"""The whole way from 2D points to a walk: synthetic people whose truth is known, through every picture there may be."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import GapError, MotionError
from motionenv.lifting import Lifted, lift, project_markers
from motionenv.metrics import aligned_mpjpe, mpjpe, pelvis_mpjpe
from motionenv.models.synthesis import synthesize
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Markers, Points

FPS = 30.0


@pytest.fixture(scope="module")
def walk() -> Markers:
    motion = synthesize("walk/fpca", 4, FPS, seed=7)
    return Markers(MARKERS, markers(motion.poses, motion.skeleton), FPS)


@pytest.mark.parametrize("degrees", [0, 40, 90, 150, -60])
def test_points_in_metres_give_the_motion_at_its_size(walk, degrees):
    points = project_markers(walk, np.radians(degrees))
    lifted = lift(points)
    assert repr(lifted) == "Lifted(120 frames)"
    assert lifted.points.unit == "m"
    assert pelvis_mpjpe(lifted.positions, points.truth.positions).mean() < 0.035
    flat = lambda places: (places - places[:, [MARKERS.index("pelvis")]])[..., [0, 2]]
    shown, true = flat(lifted.positions), flat(points.truth.positions)
    assert (shown * true).sum() / (true**2).sum() == pytest.approx(1.0, abs=0.02)
    way = lambda places: np.linalg.norm(places[-1, 2, :2] - places[0, 2, :2])
    assert 0.65 < way(lifted.positions) / way(points.truth.positions) < 1.15


def test_feet_in_metres_are_lifted_with_the_rest(walk):
    points = project_markers(walk, 0.5)
    ends = points.truth.positions[:, [MARKERS.index(f"{side}_ankle") for side in ("left", "left", "right", "right")]]
    feet = ends[..., [0, 2]] + [[0.0, -0.05], [0.15, -0.06]] * 2
    told = []
    found = lift(replace(points, feet=feet), on_progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    about = lambda places: (places - places.mean(axis=1, keepdims=True))[..., [0, 2]]
    assert np.abs(about(found.feet) - about(np.stack([feet[..., 0], feet[..., 0], feet[..., 1]], -1))).mean() < 0.03


def test_bands_hold_the_truth_about_as_often_as_they_say(walk):
    covered = []
    for degrees in range(0, 360, 60):
        points = project_markers(walk, np.radians(degrees))
        lifted = lift(points)
        off = lifted.positions - points.truth.positions
        off -= off[:, [MARKERS.index("pelvis")]]
        covered.append(np.abs(off) < lifted.band)
    assert 0.8 < np.mean(covered) < 0.995


def test_a_camera_tells_where_the_walker_is(walk):
    alpha, elevation = np.radians(30), np.radians(8)
    camera = fit_view(walk.positions, alpha, width=640, height=480, elevation=elevation)
    points = project_markers(walk, alpha, elevation=elevation, camera=camera, heading=0.0)
    lifted = lift(points, camera=camera)
    assert mpjpe(lifted.markers().positions, walk.positions).mean() < 0.12
    motion = lifted.motion()
    assert np.abs(motion.poses[:, :2] - walk.positions[:, MARKERS.index("pelvis"), :2]).max() < 0.2
    free = lift(points, elevation=None)  # perspective of a camera that isn't known
    assert aligned_mpjpe(free.positions, points.truth.positions).mean() < 0.04


def test_gaps_outliers_and_exchanged_sides_do_little_harm(walk):
    rng = np.random.default_rng(2)
    clean = project_markers(walk, np.radians(50))
    positions = clean.positions.copy()
    for joint in ("hip", "knee", "ankle"):
        left, right = MARKERS.index(f"left_{joint}"), MARKERS.index(f"right_{joint}")
        positions[40:48, [left, right]] = positions[40:48, [right, left]]
    positions[rng.random(positions.shape[:2]) < 0.2] = np.nan
    positions[:, MARKERS.index("left_wrist")] = np.nan
    wild = rng.random(positions.shape[:2]) < 0.03
    positions[wild] += rng.normal(0, 0.5, (wild.sum(), 2))
    lifted = lift(Points(positions, FPS, "m", clean.truth))
    assert pelvis_mpjpe(lifted.positions, clean.truth.positions).mean() < 0.045
    assert lifted.swapped[41:47, 1].mean() > 0.8
    assert np.nanmean(lifted.free.weights[wild & np.isfinite(positions[..., 0])]) < 0.4


def test_the_body_walks_as_the_markers_do(walk):
    lifted = lift(project_markers(walk, np.radians(20)))
    motion, shown = lifted.motion(), lifted.markers()
    assert mpjpe(markers(motion.poses, motion.skeleton), shown.positions).mean() < 0.03
    speed = np.linalg.norm((shown.positions[-1] - shown.positions[0])[2, :2])
    assert speed == pytest.approx(np.linalg.norm((walk.positions[-1] - walk.positions[0])[2, :2]), rel=0.15)


def test_the_same_points_give_the_same_bytes(walk):
    points = project_markers(walk, 0.3)
    one, other = lift(points), lift(points)
    assert isinstance(one, Lifted)
    assert one.motion().poses.tobytes() == other.motion().poses.tobytes()
    assert one.band.tobytes() == other.band.tobytes()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"elevation": 1.2}, "elevation"),
        ({"elevation": "unknown"}, "elevation must be a finite number, or None"),
        ({"height": 1.7}, "height needs points in pixels"),
        ({"camera": np.eye(3)}, "camera needs points in pixels"),
        ({"camera": "front"}, "camera"),
    ],
)
def test_settings_that_do_not_go_together_are_named(walk, change, says):
    with pytest.raises(MotionError, match=says):
        lift(project_markers(walk, 0.0), **change)


def test_points_that_show_no_walk_are_refused(walk):
    points = project_markers(walk, 0.5)
    with pytest.raises(MotionError, match="millimetre"):
        lift(Points(1000 * points.positions, FPS, "m"))
    noise = np.random.default_rng(0).standard_normal(points.positions.shape)
    assert not lift(Points(points.positions.mean(axis=0) + 0.3 * noise, FPS, "m")).plausible
    with pytest.raises(GapError):
        lift(Points(np.full_like(points.positions, np.nan), FPS, "m"))


def test_misfit_does_not_depend_on_the_resolution_of_the_camera(walk):
    found = []
    for width in (320, 640, 2560):
        camera = fit_view(walk.positions, 0.5, width=width, height=3 * width // 4, elevation=0.15)
        points = project_markers(walk, 0.5, elevation=0.15, camera=camera, heading=0.0)
        found.append(lift(points, camera=camera))
    misfits = [one.misfit for one in found]
    np.testing.assert_allclose(misfits, misfits[0], rtol=1e-3)
    assert all(one.plausible for one in found)
    narrow = replace(camera, K=camera.K * np.array([[0.5, 1, 1], [1, 0.5, 1], [1, 1, 1]]))
    assert not lift(points, camera=narrow).plausible
