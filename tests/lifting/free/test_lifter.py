"""People who turn, stop and hurry before cameras that stand and move, and what isn't anybody walking."""

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.errors import GapError
from motionenv.lifting import fit_freely, lift
from motionenv.lifting.free.lifter import heading_of, limb_lengths, undetermined
from motionenv.lifting.side_labels import exchanged
from motionenv.metrics import aligned_mpjpe, mpjpe, pelvis_mpjpe
from motionenv.models.paths import WalkPath
from motionenv.models.synthesis import synthesize
from motionenv.render.cameras import fit_view, look_at
from motionenv.types import MARKERS, POSE, Markers, Motion, Points

FPS = 30.0
CIRCLE = WalkPath.arc(1.6, 60.0)
AT = {name: i for i, name in enumerate(POSE)}


def walking(seconds: float = 6.0, **asked) -> np.ndarray:
    motion = synthesize("walk/fpca", seconds, FPS, seed=4, **asked)
    return markers(motion.poses, motion.skeleton)


def seen(places: np.ndarray, camera, noise: float = 0.0) -> Points:
    pixels = camera.project(places)[0] + noise * np.random.default_rng(0).standard_normal((*places.shape[:2], 2))
    return Points(pixels, FPS, "px", truth=Markers(MARKERS, places, FPS))


@pytest.fixture(scope="module")
def circling():
    places = walking(path=CIRCLE, speed=1.1)
    return places, fit_view(places, 0.4, width=640, height=480, elevation=0.12)


def test_somebody_who_walks_in_a_circle_is_lifted(circling):
    places, camera = circling
    lifted = lift(seen(places, camera, 1.0), camera=camera)
    assert lifted.plausible
    assert pelvis_mpjpe(lifted.positions, places).mean() < 0.045
    assert mpjpe(lifted.positions, places).mean() < 0.15
    off = lifted.heading - heading_of(places, FPS)
    assert np.degrees(np.abs((off + np.pi) % (2 * np.pi) - np.pi)).mean() < 8
    about = lambda p: p - p[:, [2]]
    assert np.mean(np.abs(about(lifted.positions) - about(places)) < lifted.band) > 0.8
    true = limb_lengths(places)
    assert lifted.limb_lengths == pytest.approx(true, rel=0.2)
    assert 0.45 < lifted.contact.mean() < 0.75
    assert lifted.confidence.shape == (len(places), 15)
    motion = lifted.motion()
    assert mpjpe(markers(motion.poses, motion.skeleton), lifted.positions).mean() < 0.03


def test_stops_and_starts(circling):
    places = walking(path=CIRCLE, speed=[[0, 1.2], [2, 0], [3, 0], [5, 1.3]])
    camera = circling[1]
    lifted = lift(seen(places, camera), camera=camera)
    assert pelvis_mpjpe(lifted.positions, places).mean() < 0.05
    speed = np.linalg.norm(np.diff(lifted.positions[:, 2, :2], axis=0), axis=1) * FPS
    assert speed[65:85].mean() < 0.4 < speed[:20].mean()


def test_a_camera_that_moves_sees_the_same_world(circling):
    places, _ = circling
    cameras = [look_at((5 + 0.01 * i, 0.5, 1.4), (0, 1.5, 0.9)) for i in range(len(places))]
    pixels = np.stack([camera.project(place)[0] for camera, place in zip(cameras, places, strict=True)])
    lifted = lift(Points(pixels, FPS, "px"), camera=cameras)
    assert pelvis_mpjpe(lifted.positions, places).mean() < 0.06
    assert mpjpe(lifted.positions, places).mean() < 0.25


def test_nothing_known_of_the_camera_costs_size_and_place_only(circling):
    places, camera = circling
    points = seen(places, camera)
    level = lift(points, elevation=0.12)
    assert aligned_mpjpe(level.positions, places).mean() < 0.045
    guessed = lift(points, camera=camera.K, elevation=None)
    assert aligned_mpjpe(guessed.positions, places).mean() < 0.05
    assert guessed.free.unit_deviation > lift(points, camera=camera).free.unit_deviation


def test_exchanged_sides_are_found(circling):
    places, camera = circling
    labels = np.zeros((len(places), 2), dtype=bool)
    labels[40:60, 1] = labels[100:104] = True
    points = seen(places, camera, 1.0)
    mixed = Points(exchanged(points.positions, labels), FPS, "px")
    lifted = lift(mixed, camera=camera)
    assert (lifted.swapped == labels).mean() > 0.97
    assert pelvis_mpjpe(lifted.positions, places).mean() < 0.05


def test_sides_exchanged_throughout_are_doubted(circling):
    places, camera = circling
    labels = np.ones((len(places), 2), dtype=bool)
    found = fit_freely(Points(exchanged(seen(places, camera).positions, labels), FPS, "px"), camera)
    assert found.other.probability > 0.9
    assert pelvis_mpjpe(found.other.positions, places).mean() < 0.05
    assert lift(seen(places, camera), camera=camera).free.other is None
    still = np.repeat(standing(), 40, axis=0)  # from the side, a person who stands could face either way
    side = fit_view(still, np.pi / 2, width=640, height=480, elevation=0.0)
    doubtful = fit_freely(seen(still, side, 8.0), side)
    assert 0.01 <= doubtful.other.probability <= 0.99
    assert pelvis_mpjpe(doubtful.other.positions, doubtful.positions).mean() > 0.03


def test_long_sequences_are_fitted_in_overlapping_stretches():
    places = walking(50.0, speed=1.0, path=CIRCLE)
    camera = fit_view(places, 0.4, width=640, height=480, elevation=0.12)
    found = fit_freely(seen(places, camera), camera)
    assert np.linalg.norm(np.diff(found.positions, axis=0), axis=-1).max() < 0.35
    assert pelvis_mpjpe(found.positions, places).mean() < 0.06


def test_somebody_may_leave_and_come_back():
    places = walking(16.0, speed=1.0, path=CIRCLE)
    camera = fit_view(places, 0.4, width=640, height=480, elevation=0.12)
    pixels, shares = camera.project(places)[0], []
    pixels[150:330] = np.nan
    lifted = lift(Points(pixels, FPS, "px"), camera=camera, on_progress=shares.append)
    gone = np.isnan(lifted.positions).any(axis=(1, 2))
    assert (gone == (np.arange(len(places)) // 30 >= 5) & (np.arange(len(places)) // 30 < 11)).all()
    assert lifted.plausible
    assert lifted.unlike[gone].all()
    assert pelvis_mpjpe(lifted.positions[~gone], places[~gone]).mean() < 0.045
    assert np.isfinite(lifted.heading[350:]).all()
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    with pytest.raises(GapError, match="never shows four markers at once"):
        fit_freely(Points(np.where(np.arange(15)[:, None] < 3, pixels, np.nan), FPS, "px"), camera)


def sitting() -> np.ndarray:
    poses = np.zeros((90, len(POSE)))
    for side in ("left", "right"):
        poses[:, AT[f"{side}_hip_flexion"]] = poses[:, AT[f"{side}_knee_flexion"]] = 1.5
    poses[:, 2] = 0.5
    return markers(poses, from_height(1.75))


def on_all_fours() -> np.ndarray:
    t = np.arange(90) / FPS
    poses = np.zeros((90, len(POSE)))
    poses[:, AT["root_tilt"]], poses[:, 0], poses[:, 2] = 1.4, 1.2 * t, 0.7
    for side, phase in (("left", 0.0), ("right", np.pi)):
        swing = 2 * np.pi * 1.5 * t + phase
        poses[:, AT[f"{side}_hip_flexion"]] = 1.4 + 0.4 * np.sin(swing)
        poses[:, AT[f"{side}_shoulder_flexion"]] = 1.4 - 0.4 * np.sin(swing)
    return markers(Motion(poses, from_height(1.75), FPS).poses, from_height(1.75))


def standing() -> np.ndarray:
    return markers(np.zeros((1, len(POSE))), from_height(1.75)) + np.array([0, 0, 0.9])


@pytest.mark.parametrize("what", ["all fours", "sitting", "noise"])
def test_what_is_not_walking_is_told_and_has_no_bands(what, circling):
    rng = np.random.default_rng(1)
    places = {
        "all fours": on_all_fours(),
        "sitting": sitting(),
        "noise": standing() + 0.3 * rng.standard_normal((90, 15, 3)),
    }[what]
    camera = fit_view(places, 0.5, width=640, height=480, elevation=0.1)
    lifted = lift(seen(places, camera), camera=camera)
    assert not lifted.plausible
    assert lifted.unlike.mean() > 0.5
    assert np.isnan(lifted.band[lifted.unlike]).all()


def test_points_in_metres_from_a_near_camera_give_its_postures(circling):
    """Sports2D's metres: pixels divided by their number per metre, from the floor upwards."""
    places, camera = circling
    pixels = Points(camera.project(places)[0], 30.0, "px")
    metres = Points((pixels.positions - [100.0, 460.0]) * [1, -1] / 183.0, 30.0, "m")
    one, other = lift(pixels), lift(metres)
    assert aligned_mpjpe(one.positions, other.positions).mean() < 0.04


def test_what_is_not_seen_is_not_determined():
    """By brute force: a marker counts within a second of a frame that shows it, if a whole leg does, too."""
    rng = np.random.default_rng(0)
    seen = np.repeat(rng.random((30, 15)) < 0.35, 4, axis=0)
    fps = 5.0
    legs = [[MARKERS.index(f"{side}_{part}") for part in ("hip", "knee", "ankle")] for side in ("left", "right")]
    lately = np.array([[seen[max(t - 5, 0) : t + 6, m].any() for m in range(15)] for t in range(len(seen))])
    expected = lately & (lately[:, legs[0]].all(1) | lately[:, legs[1]].all(1))[:, None]
    np.testing.assert_array_equal(~undetermined(seen, fps), expected)
    assert 0.1 < expected.mean() < 0.9


def test_bands_are_only_of_what_is_determined(circling):
    places, camera = circling
    positions = camera.project(places)[0]
    arms = ["elbow" in name or "wrist" in name for name in MARKERS]
    positions[:, arms] = np.nan
    lifted = lift(Points(positions, 30.0, "px"), camera=camera)
    np.testing.assert_array_equal(np.isnan(lifted.band), np.broadcast_to(np.array(arms)[:, None], lifted.band.shape))
    np.testing.assert_array_equal(np.isnan(lifted.confidence), np.isnan(lifted.band[..., 0]))
    assert lifted.plausible
    positions[:, ["hip" not in name and "shoulder" not in name for name in MARKERS]] = np.nan
    trunk = lift(Points(positions, 30.0, "px"), camera=camera)
    assert np.isnan(trunk.band).all()
    assert not trunk.plausible
