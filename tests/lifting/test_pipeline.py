"""The whole way from 2D points to a walk: synthetic people whose truth is known, through every picture there may be."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import GapError, MotionError
from motionenv.lifting import MISFIT_LIMIT, Lifted, lift, project_markers
from motionenv.metrics import aligned_mpjpe, mpjpe, pelvis_mpjpe
from motionenv.models.eigenwalkers.fourier_series import OTHER_SIDE, columns
from motionenv.models.registry import load
from motionenv.models.synthesis import synthesize
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Markers, Points

FPS = 30.0


@pytest.fixture(scope="module")
def walk() -> Markers:
    motion = synthesize("walk/fpca", 4, FPS, seed=7)
    return Markers(MARKERS, markers(motion.poses, motion.skeleton), FPS)


def distance(a: float, b: float) -> float:
    """Degrees between two angles [rad]."""
    return float(np.degrees(abs((a - b + np.pi) % (2 * np.pi) - np.pi)))


@pytest.mark.parametrize("degrees", [0, 40, 90, 150, -60])
def test_an_unknown_view_is_found_and_the_walk_with_it(walk, degrees):
    points = project_markers(walk, np.radians(degrees))
    lifted = lift(points)
    found = lifted.posterior
    assert repr(lifted) == f"Lifted(120 frames of a steady walk, seen at {np.degrees(found.alpha):.0f}°)"
    assert distance(found.alpha, np.radians(degrees)) < 4
    assert pelvis_mpjpe(found.positions, points.truth.positions).mean() < 0.035
    given = lift(points, np.radians(degrees), prior=load("walk/prior"))
    assert distance(given.posterior.alpha, np.radians(degrees)) < 0.01
    assert given.posterior.standard_deviation("alpha") < 1e-5


def test_bands_hold_the_truth_about_as_often_as_they_say(walk):
    covered = []
    for degrees in range(0, 360, 60):
        points = project_markers(walk, np.radians(degrees))
        lifted = lift(points)
        off = lifted.posterior.positions - points.truth.positions
        off -= off[:, [MARKERS.index("pelvis")]]
        covered.append(np.abs(off) < lifted.band)
    assert 0.8 < np.mean(covered) < 0.99


def test_a_camera_tells_where_the_walker_is(walk):
    alpha, elevation = np.radians(30), np.radians(8)
    camera = fit_view(walk.positions, alpha, width=640, height=480, elevation=elevation)
    points = project_markers(walk, alpha, elevation=elevation, camera=camera, heading=0.0)
    lifted = lift(points, camera=camera)
    assert mpjpe(lifted.markers().positions, walk.positions).mean() < 0.12
    motion = lifted.motion()
    assert np.abs(motion.poses[:, :2] - walk.positions[:, MARKERS.index("pelvis"), :2]).max() < 0.2
    with pytest.raises(MotionError, match="lifted orthographically"):
        lift(points, camera=camera, method="steady")
    unknown = lift(points, elevation=None, method="steady")
    assert distance(unknown.posterior.alpha, alpha) < 8
    assert distance(unknown.posterior.elevation, elevation) < 6
    assert pelvis_mpjpe(unknown.positions, points.truth.positions).mean() < 0.05
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
    assert distance(lifted.posterior.alpha, np.radians(50)) < 6
    assert pelvis_mpjpe(lifted.posterior.positions, clean.truth.positions).mean() < 0.045
    assert lifted.swapped[41:47, 1].mean() > 0.8
    assert np.nanmean(lifted.posterior.weights[wild & np.isfinite(positions[..., 0])]) < 0.4


@pytest.mark.parametrize("degrees", [-70, 140])
def test_a_known_view_that_points_contradict_is_told(walk, degrees):
    points, alpha = project_markers(walk, np.radians(degrees)), np.radians(degrees)
    assert lift(points, alpha).contradiction is None
    assert lift(points).contradiction is None
    assert distance(lift(points, alpha + 0.6).contradiction.alpha, alpha) < 5
    exchanged = Points(points.positions[:, OTHER_SIDE], FPS, "m")
    assert distance(lift(exchanged, alpha).contradiction.alpha, -alpha) < 5


def test_a_scale_that_makes_giants_is_refused(walk):
    pixels = 300 * project_markers(walk, 0.5).positions * [1, -1] + [900, 700]
    with pytest.raises(MotionError, match="correct the scale"):
        lift(Points(pixels, FPS, "px"), scale=100.0)
    assert lift(Points(pixels, FPS, "px"), scale=310.0).posterior.scale == pytest.approx(310)


def test_the_body_walks_as_the_markers_do(walk):
    lifted = lift(project_markers(walk, np.radians(20)))
    motion, shown = lifted.motion(), lifted.markers()
    assert mpjpe(markers(motion.poses, motion.skeleton), shown.positions).mean() < 0.03
    speed = (shown.positions[-1] - shown.positions[0])[2, 0] / (len(shown.positions) - 1) * FPS
    truth = (walk.positions[-1] - walk.positions[0])[2, 0] / (len(walk.positions) - 1) * FPS
    assert speed == pytest.approx(truth, rel=0.15)
    assert lifted.walker.speed == pytest.approx(speed, rel=0.1)


def test_the_same_points_give_the_same_bytes(walk):
    points = project_markers(walk, 0.3)
    one, other = lift(points), lift(points)
    assert isinstance(one, Lifted)
    assert one.motion().poses.tobytes() == other.motion().poses.tobytes()
    assert one.band.tobytes() == other.band.tobytes()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"alpha": np.nan}, "alpha"),
        ({"alpha": "30"}, "alpha"),
        ({"alpha": np.array([0.5, 0.6])}, "alpha"),
        ({"elevation": 1.2}, "elevation"),
        ({"elevation": "unknown"}, "elevation must be a finite number, or None"),
        ({"scale": 100.0}, "scale"),
        ({"prior": "walk/fpca"}, "WalkerPrior"),
        ({"camera": "front"}, "camera"),
    ],
)
def test_settings_that_do_not_go_together_are_named(walk, change, says):
    with pytest.raises(MotionError, match=says):
        lift(project_markers(walk, 0.0), **change)


def test_points_that_show_no_walk_are_refused(walk):
    points = project_markers(walk, 0.5)
    with pytest.raises(GapError, match="strides"):
        lift(Points(points.positions[:30], FPS, "m"))
    with pytest.raises(MotionError, match="millimetre"):
        lift(Points(1000 * points.positions, FPS, "m"))
    noise = np.random.default_rng(0).standard_normal(points.positions.shape)
    with pytest.raises(MotionError):
        lift(Points(points.positions.mean(axis=0) + 0.1 * noise, FPS, "m"))
    with pytest.raises(GapError):
        lift(Points(np.full_like(points.positions, np.nan), FPS, "m"))


def test_a_walk_played_backwards_is_told(walk):
    points = project_markers(walk, np.radians(60))
    assert lift(points).plausible
    for found in (lift(Points(points.positions[::-1], FPS, "m")), lift(points, np.radians(110))):
        assert found.misfit > MISFIT_LIMIT
        assert not found.plausible


@pytest.mark.parametrize(("degrees", "seed"), [(90, 0), (-140, 3)])
def test_misfit_does_not_depend_on_the_unit_or_size_of_the_picture(degrees, seed):
    motion = synthesize("walk/fpca", 3, FPS, seed=seed)
    walk = Markers(MARKERS, markers(motion.poses, motion.skeleton), FPS)
    metres = project_markers(walk, np.radians(degrees))
    sizes = (40.0, 300.0, 2500.0)  # pixels per metre
    pictures = [Points(metres.positions * [s, -s] + [900, 700], FPS, "px") for s in sizes]
    free = [lift(picture, method="steady").misfit for picture in pictures]
    np.testing.assert_allclose(free, free[1], rtol=1e-3)
    told = [lift(picture, scale=s).misfit for picture, s in zip(pictures, sizes, strict=True)]
    np.testing.assert_allclose(told, lift(metres).misfit, rtol=5e-3)  # in pixels, growth towards the camera is fitted
    assert max(free + told) < MISFIT_LIMIT
    assert abs(free[0] / told[0] - 1) < 0.15


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


def test_misfit_is_the_mahalanobis_distance_of_exact_walks():
    """Points of a walker k standard deviations along a component, without noise: that far from the mean by hand."""
    prior = load("walk/prior")
    t = np.arange(90) / FPS
    for k in (0.0, 4.0):
        w = prior.mean_ + k * np.sqrt(prior.explained_variance_[0]) * prior.components_[0]
        shown = np.einsum("th,hmc->tmc", columns(2 * np.pi * t), w)
        c, s = np.cos(0.7), np.sin(0.7)
        points = Points(np.stack([shown @ [c, s, 0], shown[..., 2]], axis=-1), FPS, "m")
        assert lift(points, 0.7).misfit == pytest.approx(k / np.sqrt(150), abs=0.05)


def test_long_sequences_are_refused_before_any_work(walk):
    points = project_markers(walk, 0.0)
    with pytest.raises(MotionError, match="4800 frames"):
        lift(Points(np.tile(points.positions, (40, 1, 1)), FPS, "m"))
