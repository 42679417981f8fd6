"""Real films: a walker before clutter, compressed, with noise, shadows and changing light, followed without truth."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import FormatError, MotionError
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import look_at, view
from motionenv.render.video.decode import read_frames
from motionenv.render.video.encode import write_video
from motionenv.tracking import VelocityPrior
from motionenv.tracking.priors.base import Start
from motionenv.tracking.video.detection import departure_frame, detections, resized, side_camera, span, standing_height
from motionenv.tracking.video.foreground import FilmBackground
from motionenv.tracking.video.multi_start import exchanged
from motionenv.tracking.video.track import track_video
from motionenv.types import MARKERS

FPS, HEIGHT, FRAMES = 30, 1.75, 60


@pytest.fixture(scope="module")
def crossing(tmp_path_factory):
    """A film of somebody who crosses the picture, its camera, his poses and body."""
    rng = np.random.default_rng(5)
    walk = synthesize("walk/fpca", FRAMES / FPS, FPS, seed=21, height=HEIGHT)
    poses = walk.poses - np.eye(25)[0] * walk.poses[:, :1].mean()
    camera = view(0.0, width=256, height=192, distance=5.0)
    limbs = render(poses, walk.skeleton, camera).limbs
    clutter = rng.integers(40, 220, (24, 32, 3)).repeat(8, axis=0).repeat(8, axis=1).astype(float)
    clothes = np.array([[0, 0, 0], *rng.integers(0, 255, (limbs.max(), 3))])
    light = 1 + 0.05 * np.sin(np.arange(FRAMES) / 9)
    pictures = np.where(limbs[..., None] > 0, clothes[limbs], clutter) * light[:, None, None, None]
    noisy = np.clip(pictures + 6 * rng.standard_normal(pictures.shape), 0, 255).astype(np.uint8)
    path = tmp_path_factory.mktemp("films") / "walk.mp4"
    write_video(path, noisy, FPS, crf=30)
    return path, camera, poses, walk.skeleton, limbs > 0


def pelvis_error(track, poses, skeleton) -> np.ndarray:
    """Mean distance (T,) of the joints, the pelvis in its place [m]."""
    found, true = markers(track.motion.poses, track.motion.skeleton), markers(poses, skeleton)
    return np.linalg.norm(found - found[:, 2:3] - true + true[:, 2:3], axis=-1).mean(axis=-1)


def test_a_film_with_its_camera(crossing):
    path, camera, poses, skeleton, _ = crossing
    track = track_video(path, camera, particles=500, attempts=2, seed=1)
    error = pelvis_error(track, poses, skeleton)
    assert track.followed.sum() > 0.9 * FRAMES
    assert np.nanmean(error) < 0.1
    assert np.nanmean(track.overlap) > 0.5
    assert not track.guessed
    assert np.nanmean(np.linalg.norm(track.motion.poses[:, :2] - poses[:, :2], axis=-1)) < 0.3
    assert np.isnan(track.particles[~track.followed]).all()


def test_a_film_of_an_unknown_camera_by_seed_alone(crossing):
    path, camera, poses, _, _ = crossing
    tracks = [track_video(path, particles=200, attempts=1, seed=2, threads=k, seconds=1.0) for k in (1, 2)]
    np.testing.assert_array_equal(tracks[0].motion.poses, tracks[1].motion.poses)
    assert tracks[0].guessed
    assert (tracks[0].camera.width, tracks[0].camera.height) == (256, 192)
    assert tracks[0].camera.centre[2] == pytest.approx(camera.centre[2], abs=0.4)
    headings = tracks[0].motion.poses[tracks[0].followed, 5]
    assert np.cos(headings - poses[0, 5]).min() > 0.5
    assert len(tracks[0].motion.poses) == FPS


def test_another_prior_another_rate_and_progress(crossing):
    path, camera, *_ = crossing
    ticks = []
    track = track_video(
        path, camera, prior=lambda s, f: VelocityPrior(skeleton=s, fps=f), particles=100, attempts=2, fps=15.0,
        progress=lambda done, total: ticks.append((done, total)),
    )  # fmt: skip
    assert len(track.motion.poses) == FRAMES / 2
    assert ticks[-1][0] == ticks[-1][1] == 2 * track.followed.sum()


def test_a_background_of_the_films_own_size(crossing):
    path, camera, *_ = crossing
    empty = np.median(np.stack(list(read_frames(path))), axis=0)
    noisy = empty + 12 * np.random.default_rng(0).standard_normal((20, *empty.shape))
    background = np.clip(noisy, 0, 255).astype(np.uint8)
    track = track_video(path, camera, particles=300, attempts=1, seconds=1.0, background=background, seed=1)
    assert np.nanmean(track.overlap) > 0.5


def test_what_moves_is_told_from_noise_light_and_shadows():
    rng = np.random.default_rng(0)
    plain = rng.integers(80, 200, (48, 64, 3)).astype(float)
    film = np.clip(plain + 4 * rng.standard_normal((20, 48, 64, 3)), 0, 255).astype(np.uint8)
    background = FilmBackground(film)
    assert (background.foreground(film[3]) > 0.5).mean() < 0.001
    assert (background.foreground((0.9 * film[3]).astype(np.uint8)) > 0.5).mean() < 0.01
    shaded = film[3].copy()
    shaded[30:] = (0.75 * shaded[30:]).astype(np.uint8)
    assert (background.foreground(shaded) > 0.5).mean() < 0.02
    bodied = film[3].copy()
    bodied[10:40, 20:30] = (200, 30, 40)
    assert (background.foreground(bodied)[12:38, 22:28] > 0.5).mean() > 0.95


def test_a_guessed_camera_puts_the_person_on_the_ground(crossing):
    _, _, _, skeleton, masks = crossing
    boxes = detections(masks.astype(float))
    guess = side_camera(boxes, skeleton, 256, 192)
    feet = guess.project(np.zeros(3))[0]
    crown = guess.project(np.array([0.0, 0.0, HEIGHT]))[0]
    assert feet[1] == pytest.approx(np.median(boxes[:, 3]), abs=2)
    assert feet[1] - crown[1] == pytest.approx(np.median(boxes[:, 3] - boxes[:, 2]), rel=0.05)
    small = resized(guess, 128, 96)
    np.testing.assert_allclose(small.project(np.ones(3))[0] + 0.5, (guess.project(np.ones(3))[0] + 0.5) / 2)


def test_height_by_a_known_camera(crossing):
    _, camera, _, _, masks = crossing
    boxes = detections(masks.astype(float))
    assert standing_height(boxes, camera) == pytest.approx(HEIGHT, rel=0.04)
    high = look_at((0, -6, 4), (0, 0, 0.5), width=256, height=192)
    seen, _ = high.project(np.array([[0.0, 0, 1.6], [0, 0, 0]]))
    box = [seen[0, 0] - 9, seen[0, 0] + 9, seen[0, 1] + 0.5, seen[1, 1] - 0.5]
    assert standing_height(np.array([box]), high) == pytest.approx(1.6, rel=1e-3)
    with pytest.raises(MotionError, match="check the camera"):
        standing_height(boxes - [0, 0, 0, 60], camera)


def test_when_somebody_is_there():
    boxes = np.full((20, 4), np.nan)
    boxes[3:6] = [0, 10, 5, 30]
    boxes[6:15] = [20, 30, 5, 30]
    assert span(boxes, 64) == (6, 15)
    with pytest.raises(MotionError, match="no foreground"):
        span(boxes[:9], 64)


def test_walking_begins_where_the_outline_moves_on():
    boxes = np.tile([20.0, 40.0, 10.0, 70.0], (60, 1))
    boxes[25:, :2] += 1.5 * np.arange(35)[:, None]
    boxes[:4] = np.nan
    assert 12 <= departure_frame(boxes, 30.0) <= 20
    assert departure_frame(np.tile([20.0, 40.0, 10.0, 70.0], (60, 1)), 30.0) == 0


def test_an_exchanged_start_is_the_mirror_image_in_the_plane_of_walking(crossing):
    _, _, poses, skeleton, _ = crossing
    start = Start.at(poses[7], poses[6])
    other = exchanged(start)
    heading = np.array([np.cos(poses[7, 5]), np.sin(poses[7, 5]), 0.0])
    aside = np.array([-heading[1], heading[0], 0.0])
    true, found = (markers(s.poses[0], skeleton) - [*poses[7, :2], 0.0] for s in (start, other))
    swapped = [MARKERS.index(m.replace("left", "*").replace("right", "left").replace("*", "right")) for m in MARKERS]
    np.testing.assert_allclose((found @ aside)[swapped], -(true @ aside), atol=1e-9)
    np.testing.assert_allclose((found @ heading)[swapped], true @ heading, atol=1e-9)
    np.testing.assert_allclose(exchanged(other).previous, start.previous, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"camera": view(0.0, width=100, height=300)}, "aspect"),
        ({"attempts": 0}, "attempts"),
        ({"layers": 0}, "layers"),
        ({"fps": 0}, "fps"),
        ({"seconds": -1}, "seconds"),
        ({"height": 5}, "height"),
        ({"background": np.zeros((5, 9, 9, 3), dtype=np.uint8)}, "shape"),
    ],
)
def test_what_can_not_be_is_refused(crossing, change, says):
    with pytest.raises(MotionError, match=says):
        track_video(crossing[0], **change)


def test_films_that_are_none(crossing, tmp_path):
    whole = crossing[0].read_bytes()
    for name, content in {"empty": b"", "noise": bytes(range(256)) * 99, "cut": whole[: len(whole) // 2]}.items():
        path = tmp_path / f"{name}.mp4"
        path.write_bytes(content)
        with pytest.raises(FormatError, match=name):
            track_video(path)
    write_video(tmp_path / "still.mp4", np.full((9, 64, 64, 3), 50, dtype=np.uint8), 30)
    with pytest.raises(MotionError, match="no foreground"):
        track_video(tmp_path / "still.mp4")
    write_video(tmp_path / "short.mp4", np.full((2, 64, 64, 3), 50, dtype=np.uint8), 30)
    with pytest.raises(FormatError, match="too few"):
        track_video(tmp_path / "short.mp4")
