"""Detections that guide the tracker of a film: whom they choose, what they tell, and how the film goes on without."""

import json

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.render.video.encode import write_video
from motionenv.tracking.video.track import Film, find_people, track_video
from motionenv.types import MARKERS, Points


def relative_error(track, poses, skeleton) -> np.ndarray:
    """Mean distance (T,) of expected joints about the pelvis [m]."""
    found, true = markers(track.expected, track.motion.skeleton), markers(poses, skeleton)
    return np.linalg.norm(found - found[:, 2:3] - true + true[:, 2:3], axis=-1).mean(axis=-1)


@pytest.fixture(scope="module")
def seen(crossing):
    """What a detector sees of the walker, and somebody who stands at the side, smaller, in the same film."""
    _, camera, poses, skeleton, _ = crossing
    walker = DetectorErrors().apply(Points(camera.project(markers(poses, skeleton))[0], 30, "px"), 3)
    standing = 0.3 * walker.positions[30] + [20, 60] + np.random.default_rng(0).normal(0, 0.5, (60, 15, 2))
    return [Points(standing, 30, "px", confidence=np.full((60, 15), 0.9)), walker]


def test_detections_choose_the_larger_person_and_are_as_exact_as_they_should_be(crossing, seen):
    path, camera, poses, skeleton, _ = crossing
    people = find_people(Film(path, detections=seen))
    assert [round(p.height) > 60 for p in people] == [True, False]
    track = track_video(Film(path, detections=seen), camera, particles=200, seed=1)
    assert track.person.points is seen[1]
    assert track.followed.mean() > 0.9
    assert np.nanmedian(relative_error(track, poses, skeleton)) < 0.06
    again = track_video(Film(path, detections=seen), camera, particles=200, seed=1)
    np.testing.assert_array_equal(track.motion.poses, again.motion.poses)


def test_sides_are_those_of_the_detections(crossing, seen):
    """Outlines hardly tell left from right: the same film with sides exchanged in all points is followed so."""
    path, camera, poses, skeleton, _ = crossing
    track = track_video(Film(path, detections=seen[1]), camera, particles=200, seed=1)
    joints = markers(track.expected, track.motion.skeleton)
    true = markers(poses, skeleton)
    left, right = MARKERS.index("left_ankle"), MARKERS.index("right_ankle")
    apart, truly = ((p[:, left] - p[:, right])[:, 0] for p in (joints, true))
    known = np.isfinite(apart)
    assert np.corrcoef(apart[known], truly[known])[0, 1] > 0.9


def test_where_detections_stop_nobody_is_followed(crossing, seen):
    path, camera, poses, skeleton, _ = crossing
    positions = seen[1].positions.copy()
    positions[30:] = np.nan
    half = Points(positions, 30, "px", confidence=seen[1].confidence)
    track = track_video(Film(path, detections=half), camera, particles=200, seed=1)
    assert track.followed[:30].mean() > 0.8
    assert not track.followed[30:].any()
    assert track.losses[-1].left
    assert np.nanmedian(relative_error(track, poses, skeleton)) < 0.08


def test_detections_hold_where_nothing_has_an_outline(crossing, seen, tmp_path):
    """As of somebody in front of a wall of his colour."""
    _, camera, poses, skeleton, _ = crossing
    rng = np.random.default_rng(0)
    wall = rng.integers(40, 220, (24, 32, 3)).repeat(8, axis=0).repeat(8, axis=1)
    noisy = np.clip(wall + rng.normal(0, 2, (60, *wall.shape)), 0, 255).astype(np.uint8)
    write_video(tmp_path / "wall.mp4", noisy, 30)
    track = track_video(Film(tmp_path / "wall.mp4", detections=seen[1]), camera, particles=100, seed=1)
    assert track.followed.mean() > 0.9
    assert np.nanmax(track.overlap) < 0.1
    assert np.nanmedian(relative_error(track, poses, skeleton)) < 0.06


def test_files_and_points_that_are_refused(crossing, seen, tmp_path):
    path, camera, *_ = crossing
    metres = Points(seen[1].positions / 100, 30, "m")
    for wrong in ([], [metres], [3]):
        with pytest.raises(MotionError, match="detections must be a file, or Points in the film's pixels"):
            track_video(Film(path, detections=wrong), camera)
    with pytest.raises(MotionError, match="person must be from 1 to 2"):
        track_video(Film(path, detections=seen), camera, person=3)
    halves = {"frame": 0, "landmarks": [{"x": 0.5, "y": 0.5, "visibility": 0.9}] * 33}
    (tmp_path / "still.json").write_text(json.dumps([{**halves, "frame": t} for t in range(60)]))
    with pytest.raises(MotionError):  # coordinates relative to the picture are understood, but are nobody
        track_video(Film(path, detections=tmp_path / "still.json"), camera)
