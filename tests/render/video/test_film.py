"""Films of walks and of tracks."""

import numpy as np
import pytest

import motionenv
from motionenv.body import from_height, markers
from motionenv.errors import GapError, MotionError
from motionenv.render import Scene, render
from motionenv.render.cameras import view
from motionenv.render.video.film import cameras_for, film, picture
from motionenv.render.video.tracking_film import marked, track_film
from motionenv.types import Motion


@pytest.fixture(scope="module")
def walk() -> Motion:
    """35 frames: more than are drawn at a time."""
    return motionenv.load("walk/fpca").synthesize(3.5, 10, seed=2)


@pytest.mark.parametrize("follow", [True, False])
@pytest.mark.parametrize("alpha", [0.0, np.pi / 4, np.pi / 2, -2.0])
def test_the_whole_walker_is_in_every_picture(walk, alpha, follow):
    cameras = cameras_for(walk, alpha, 96, 72, follow=follow)
    assert len(cameras) == len(walk.poses)
    assert (len({camera.t.tobytes() for camera in cameras}) > 1) == follow
    for points, camera in zip(markers(walk.poses, walk.skeleton), cameras, strict=True):
        pixels, depth = camera.project(points)
        assert (depth > 0).all()
        assert (pixels > 0).all()
        assert (pixels < [96, 72]).all()
        tall = np.ptp(pixels[:, 1])
        assert tall > (36 if follow else 4)


def test_frames_are_those_of_a_rendering(walk):
    frames = np.array(list(film(walk, 0.5, width=64, height=48)))
    assert frames.shape == (35, 48, 64, 3)
    assert frames.dtype == np.uint8
    cameras = cameras_for(walk, 0.5, 64, 48, follow=True)
    expected = render(walk.poses, walk.skeleton, cameras, scene=Scene(samples=2)).rgb
    np.testing.assert_array_equal(frames, expected)


def test_a_following_camera_keeps_the_walker_in_the_middle(walk):
    for points, camera in zip(
        markers(walk.poses, walk.skeleton), cameras_for(walk, 0.0, 96, 72, follow=True), strict=True
    ):
        assert camera.project(points[2])[0][0] == pytest.approx(48, abs=8)


def test_points_are_15_lights_on_dark(walk):
    frames = np.array(list(film(walk, 0.0, width=160, height=120, points=True)))
    assert frames.shape == (35, 120, 160, 3)
    bright = frames.min(-1) > 128
    assert 15 <= bright[0].sum() < 0.05 * bright[0].size
    assert np.median(frames) < 60


def test_another_scene_is_used(walk):
    one, other = (next(film(walk, 0.0, width=32, height=32, scene=scene)) for scene in (None, Scene(samples=1)))
    assert (one != other).any()


@pytest.mark.filterwarnings("error")
def test_frames_without_arms_show_the_rest_where_it_was(walk):
    """Beside the arms' pixels, a film of a motion with gaps is that of the whole one; without a root it is empty."""
    poses = walk.poses.copy()
    poses[3:5, 9:17] = np.nan
    poses[5] = np.nan
    gappy = Motion(poses, walk.skeleton, 10)
    look = {"width": 96, "height": 128, "follow": False, "scene": Scene(shadows=False)}
    whole, part = (np.array(list(film(m, 0.0, **look))) for m in (walk, gappy))
    np.testing.assert_array_equal(part[[0, 1, 2, 6]], whole[[0, 1, 2, 6]])
    changed = (part[3] != whole[3]).any(-1)
    assert 0 < changed.mean() < 0.02
    assert len(np.unique(part[5].reshape(-1, 3), axis=0)) < len(np.unique(whole[5].reshape(-1, 3), axis=0))
    dots = np.array(list(film(gappy, 0.0, width=96, height=128, points=True, follow=False)))
    assert dots[5].max() == 0
    assert 0 < (dots[3] > 128).sum() < (dots[2] > 128).sum()


def test_what_can_not_be_filmed_is_refused_before_drawing(walk):
    with pytest.raises(GapError, match="no frame with a known root"):
        film(Motion(np.full((5, 25), np.nan), walk.skeleton, 10), 0.0)
    batch = motionenv.load("walk/fpca").walks(0.2, 30, n=2, seed=1)
    with pytest.raises(MotionError, match=r"one motion \(frames, 25\), got"):
        film(batch)


@pytest.mark.parametrize("how", [{}, {"points": True, "colour": (0, 0, 0), "background": (1, 1, 1)}, {"follow": False}])
def test_one_picture_is_that_of_the_film(walk, how):
    frames = list(film(walk, 0.5, width=64, height=48, elevation=0.3, **how))
    np.testing.assert_array_equal(picture(walk, 20, 0.5, width=64, height=48, elevation=0.3, **how), frames[20])
    with pytest.raises(MotionError, match="from 0 to 34, got 35"):
        picture(walk, 35)


def test_a_plain_background_and_dots_have_the_colours_asked_for(walk):
    red = next(film(walk, 0.5, width=64, height=48, background=(1.0, 0.0, 0.5)))
    assert np.abs(red[[0, -1]].astype(int) - [255, 0, 128]).max() <= 1
    dots = next(film(walk, 0.0, width=160, height=120, points=True, colour=(0, 0, 0), background=(1, 1, 1)))
    assert (dots[0] == 255).all()
    assert dots.min() == 0
    for wrong in ({"background": (2, 0, 0)}, {"colour": (0, 0)}):
        with pytest.raises(MotionError, match="from 0 to 1"):
            film(walk, 0.0, **wrong)


def test_a_camera_can_look_down(walk):
    level, steep = (cameras_for(walk, 0.0, 96, 72, follow=True, elevation=e)[0] for e in (0.0, 1.0))
    assert steep.centre[2] > level.centre[2] + 1.0
    assert np.arcsin(-steep.R[2, 2]) == pytest.approx(1.0)


def test_figure_body_and_curve_come_in_and_gaps_stay_empty():
    poses = np.full((3, 25), np.nan)
    poses[1:] = np.eye(25)[2] * 0.93
    particles = np.repeat(poses[:, None], 4, axis=1)
    pictures = np.zeros((3, 100, 120, 3), dtype=np.uint8)
    camera = view(0.0, width=120, height=100)
    frames = list(track_film(pictures, camera, poses, particles, from_height(), [np.nan, 0.5, 0.7], label="error"))
    assert {f.shape for f in frames} == {(124, 120 + 4 + 100, 3)}
    assert not frames[0][:100, :120].any()
    assert frames[1][:100, :120].any()
    assert np.ptp(frames[0][:100, 124:]) == 0
    assert np.ptp(frames[1][:100, 124:]) > 100
    assert (frames[2][100:] != frames[1][100:]).any()


def test_shapes_that_do_not_go_together():
    camera, body = view(0.0, width=32, height=32), from_height()
    with pytest.raises(MotionError, match="must agree"):
        next(track_film([], camera, np.zeros((2, 25)), np.zeros((3, 1, 25)), body, np.zeros(2)))
    pictures = np.zeros((2, 32, 32, 3), dtype=np.uint8)
    with pytest.raises(MotionError, match="outnumber"):
        list(track_film(pictures, camera, np.zeros((1, 25)), np.zeros((1, 1, 25)), body, np.zeros(1)))


def test_a_word_marks_the_pictures_that_it_is_for():
    pictures = np.zeros((3, 60, 80, 3), dtype=np.uint8)
    shown = list(marked(pictures, [False, True, False], "LOST"))
    assert [bool(p.any()) for p in shown] == [False, True, False]
    assert shown[1][:30].any()
    assert not shown[1][40:].any()
