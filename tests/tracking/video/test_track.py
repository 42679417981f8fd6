"""Real films: a walker before clutter, compressed, with noise, shadows and changing light, followed without truth."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import FormatError, MotionError
from motionenv.render.cameras import view
from motionenv.render.video.decode import read_frames
from motionenv.render.video.encode import write_video
from motionenv.tracking import VelocityPrior
from motionenv.tracking.video.track import Film, find_people, track_video

FPS, FRAMES = 30, 60  # of the film

pytestmark = pytest.mark.usefixtures("blazepose")


def pelvis_error(track, poses, skeleton) -> np.ndarray:
    """Mean distance (T,) of the joints, the pelvis in its place [m]."""
    found, true = markers(track.motion.poses, track.motion.skeleton), markers(poses, skeleton)
    return np.linalg.norm(found - found[:, 2:3] - true + true[:, 2:3], axis=-1).mean(axis=-1)


def test_a_film_with_its_camera(crossing):
    path, camera, poses, skeleton, _ = crossing
    track = track_video(path, camera, particles=500, seed=1)
    error = pelvis_error(track, poses, skeleton)
    assert track.followed.sum() > 0.85 * FRAMES
    assert np.nanmean(error) < 0.12
    assert np.nanmean(track.overlap) > 0.5
    assert not track.guessed
    assert repr(track) == f"VideoTrack({track.followed.sum()} of 60 frames followed, 30 fps)"
    assert np.nanmean(np.linalg.norm(track.motion.poses[:, :2] - poses[:, :2], axis=-1)) < 0.3
    assert np.isnan(track.particles[~track.followed]).all()
    np.testing.assert_array_equal(track.expected[track.followed], track.motion.poses[track.followed])


@pytest.mark.slow
def test_a_film_of_an_unknown_camera_by_seed_alone(crossing):
    path, camera, poses, _, _ = crossing
    tracks = [track_video(path, particles=200, seed=2, threads=k) for k in (1, 2)]
    np.testing.assert_array_equal(tracks[0].motion.poses, tracks[1].motion.poses)
    assert tracks[0].guessed
    assert (tracks[0].camera.width, tracks[0].camera.height) == (256, 192)
    assert tracks[0].camera.centre[2] == pytest.approx(camera.centre[2], abs=0.4)
    headings = tracks[0].motion.poses[tracks[0].followed, 5]
    assert np.cos(headings - poses[0, 5]).min() > 0.5
    assert len(tracks[0].motion.poses) == FRAMES


def test_another_prior_another_rate_and_progress(crossing):
    path, camera, *_ = crossing
    ticks = []
    film = Film(path, fps=15.0)
    people = find_people(film)
    left, right, top, bottom = people[0].boxes[10]
    track = track_video(
        film, camera, box=(left, top, right - left, bottom - top), particles=100,
        prior=lambda s, f: VelocityPrior(skeleton=s, fps=f),
        progress=lambda done, total: ticks.append((done, total)),
    )  # fmt: skip
    assert len(track.motion.poses) == FRAMES / 2
    assert ticks[-1] == (len(ticks), len(ticks))
    assert 0.8 * FRAMES / 2 < len(ticks) <= FRAMES / 2


def test_a_background_of_the_films_own_size(crossing):
    path, camera, *_ = crossing
    empty = np.median(np.stack(list(read_frames(path))), axis=0)
    noisy = empty + 12 * np.random.default_rng(0).standard_normal((20, *empty.shape))
    background = np.clip(noisy, 0, 255).astype(np.uint8)
    film = Film(path, seconds=1.0, background=background)
    track = track_video(film, camera, particles=300, seed=1)
    assert np.nanmean(track.overlap) > 0.5


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"camera": view(0.0, width=100, height=300)}, "aspect"),
        ({"layers": 0}, "layers"),
        ({"height": 5}, "height"),
        ({"person": 1, "point": (3, 4)}, "only one of person"),
        ({"at": 1.0}, "give one of them"),
        ({"box": (1, 2, 3)}, "box must be x, y, width, height"),
    ],
)
def test_what_can_not_be_is_refused(crossing, change, says):
    with pytest.raises(MotionError, match=says):
        track_video(crossing[0], **change)


def test_a_background_of_another_shape_is_refused(crossing):
    with pytest.raises(MotionError, match="shape"):
        track_video(Film(crossing[0], background=np.zeros((5, 9, 9, 3), dtype=np.uint8)))


def test_films_that_are_none(crossing, tmp_path):
    whole = crossing[0].read_bytes()
    for name, content in {"empty": b"", "noise": bytes(range(256)) * 99, "cut": whole[: len(whole) // 2]}.items():
        path = tmp_path / f"{name}.mp4"
        path.write_bytes(content)
        with pytest.raises(FormatError, match=name):
            track_video(path)
    write_video(tmp_path / "still.mp4", np.full((9, 64, 64, 3), 50, dtype=np.uint8), 30)
    with pytest.raises(FormatError, match="shows nobody in 9 frames"):
        track_video(tmp_path / "still.mp4")
    write_video(tmp_path / "short.mp4", np.full((2, 64, 64, 3), 50, dtype=np.uint8), 30)
    with pytest.raises(FormatError, match="too few"):
        track_video(tmp_path / "short.mp4")
