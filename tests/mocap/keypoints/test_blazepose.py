"""BlazePose on people whose joints are known: rendered ones, and a real man whom four calibrated cameras see."""

from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import combinations
from threading import Thread
from zipfile import ZipFile

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.mocap.keypoints import blazepose as module
from motionenv.mocap.keypoints.blazepose import MODELS, BlazePose, read_models
from motionenv.mocap.keypoints.detector import detect_people, detector
from motionenv.mocap.keypoints.points2d import points_of
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.render.video.decode import read_frames
from motionenv.types import MARKERS

FPS = 25.0


def walk(seconds: float, seed=22):
    """A walk about the middle of the stage."""
    made = synthesize("walk/fpca", seconds, FPS, seed=seed, height=1.75)
    return made.poses - np.eye(25)[0] * made.poses[:, :1].mean(), made.skeleton


@pytest.mark.parametrize(("degrees", "most"), [(0, 0.02), (60, 0.015), (90, 0.015), (180, 0.02)])
def test_a_rendered_walker_is_seen_in_every_picture_to_a_few_hundredths_of_the_height(blazepose, degrees, most):
    poses, skeleton = walk(0.4)
    camera = view(np.radians(degrees), width=640, height=480, distance=4.5)
    pictures = [render(pose, skeleton, camera).rgb for pose in poses]
    tracks, frames = detect_people(pictures, detector("blazepose", blazepose))
    (points,) = points_of("film.mp4", tracks, frames, FPS)
    true = camera.project(markers(poses, skeleton))[0]
    tall = np.ptp(true[..., 1], axis=1).mean()
    off = np.linalg.norm(points.positions - true, axis=-1)
    assert np.isfinite(off).mean() > 0.85
    assert np.nanmedian(off) < most * tall
    for left, right in ((MARKERS.index(f"left_{j}"), MARKERS.index(f"right_{j}")) for j in ("ankle", "knee")):
        apart = np.linalg.norm(true[:, left] - true[:, right], axis=-1) > 0.1 * tall
        crossed = np.linalg.norm(points.positions[:, left] - true[:, right], axis=-1) < off[:, left]
        assert crossed[apart].sum() <= 1  # legs that pass each other are taken for each other at times


def test_a_small_person_in_a_large_picture_is_found_in_a_part_of_it(blazepose):
    poses, skeleton = walk(0.1)
    camera = view(0.5, width=1280, height=720, distance=12)
    pictures = [render(pose, skeleton, camera).rgb for pose in poses]
    true = camera.project(markers(poses, skeleton))[0]
    assert np.ptp(true[..., 1], axis=1).max() < 140
    tracks, frames = detect_people(pictures, detector("blazepose", blazepose))
    (points,) = points_of("film.mp4", tracks, frames, FPS)
    assert np.nanmedian(np.linalg.norm(points.positions - true, axis=-1)) < 4


def test_those_who_pass_each_other_stay_themselves(blazepose):
    """Two in clothes of other colours walk in opposite directions, one behind the other for a moment."""
    poses, skeleton = walk(2.0)
    camera = view(0.0, width=640, height=400, distance=6.5)
    back = poses.copy()
    back[:, 0], back[:, 1], back[:, 5] = -poses[:, 0], poses[:, 1] + 1.2, poses[:, 5] + np.pi
    pictures = []
    for near, far in zip(poses, back, strict=True):
        front, behind = (render(pose, skeleton, camera) for pose in (near, far))
        red = np.where((behind.limbs > 0)[..., None], behind.rgb[..., ::-1], behind.rgb)
        pictures.append(np.where((front.limbs > 0)[..., None], front.rgb, red))
    tracks, frames = detect_people(pictures, detector("blazepose", blazepose))
    people = points_of("film.mp4", tracks[:2], frames, FPS)
    truths = [camera.project(markers(p, skeleton))[0] for p in (poses, back)]
    ends = [[np.nanmedian(np.linalg.norm(p.positions[when] - t[when], axis=-1)) for t in truths]
            for p in people for when in (slice(0, 8), slice(-8, None))]  # fmt: skip
    who = np.argmin(ends, axis=1)
    assert sorted(who.tolist()) == [0, 0, 1, 1]
    assert who[0] == who[1]
    assert np.min(ends, axis=1).max() < 6
    assert [len(t) > 0.8 * frames for t in tracks] == [True, True] + [False] * (len(tracks) - 2)


def triangulated(rays: list[tuple]) -> np.ndarray:
    """The point whose homogeneous equations of `rays`, (3, 4) matrix and pixel, fit best."""
    rows = [pixel[axis] * P[2] - P[axis] for P, pixel in rays for axis in (0, 1)]
    found = np.linalg.svd(np.array(rows))[2][-1]
    return found[:3] / found[3]


@pytest.mark.slow
def test_four_cameras_agree_on_a_real_man_who_balances(blazepose, mocap):
    """Pose2Sim's calibration knows nothing of BlazePose: where its rays meet, limbs have a man's lengths."""
    from benchmarks.tracking.real_film import VIEWS, calibrated, film

    folder = mocap / "pose2sim"
    cameras, seen = [], []
    for name in VIEWS:
        path = film(folder, name)
        tracks, frames = detect_people(read_frames(path, seconds=0.3), detector("blazepose", blazepose))
        keypoints = np.full((18, 33, 3), np.nan)
        keypoints[list(tracks[0])] = list(tracks[0].values())
        assert len(tracks[0]) == frames == 18
        seen.append(keypoints)
        cameras.append(calibrated(folder, name))
    names = KEYPOINT_SETS["mediapipe-33"].keypoints
    matrices = [camera.K @ np.column_stack([camera.R, camera.t]) for camera in cameras]
    body = [j for j, name in enumerate(names) if name.split("_")[-1] in ("shoulder", "hip", "knee", "ankle")]
    places = np.array(
        [[triangulated([(P, k[t, j, :2]) for P, k in zip(matrices, seen, strict=True)]) for j in body]
         for t in range(0, 18, 3)]
    )  # fmt: skip
    off = [np.linalg.norm(c.project(places)[0] - k[::3, body, :2], axis=-1) for c, k in zip(cameras, seen, strict=True)]
    assert np.median(off) < 22  # of about 650 pixels of height; the films are synchronous to a few frames only
    at = dict(zip([names[j] for j in body], np.moveaxis(places, 1, 0), strict=True))
    for side in ("left", "right"):
        for upper, lower, metres in (("hip", "knee", 0.40), ("knee", "ankle", 0.38)):
            length = np.linalg.norm(at[f"{side}_{upper}"] - at[f"{side}_{lower}"], axis=-1)
            assert np.median(length) == pytest.approx(metres, abs=0.06)
            assert length.std() < 0.04


@pytest.mark.slow
def test_two_real_people_keep_their_names(blazepose, mocap):
    path = mocap / "pose2sim/Demo_MultiPerson/videos/cam04.mp4"
    tracks, frames = detect_people(read_frames(path, seconds=0.4), detector("blazepose", blazepose))
    assert [len(track) for track in tracks[:2]] == [frames, frames]
    him, her = (np.array([k[[23, 24], 0].mean() for k in track.values()]) for track in tracks[:2])
    assert min(abs(him - her)) > 150
    assert max(np.abs(np.diff(him)).max(), np.abs(np.diff(her)).max()) < 40


def test_models_come_from_a_server_once_and_checked(blazepose, tmp_path, monkeypatch):
    there, here = tmp_path / "there", tmp_path / "here"
    there.mkdir()
    with ZipFile(blazepose) as archive:
        for name in archive.namelist():
            if name.endswith(("pose_detection.tflite", "pose_landmark_full.tflite")):
                (there / name.rpartition("/")[2]).write_bytes(archive.read(name))
    asked = []

    class Handler(SimpleHTTPRequestHandler):
        def log_message(self, *args):
            asked.append(self.path)

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(there))) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        url = f"http://127.0.0.1:{server.server_port}"
        for _ in range(2):
            assert read_models(None, here, url) == read_models(there, here) == read_models(blazepose, here)
        assert len(asked) == 2
        (there / MODELS.files[1].path).write_bytes(b"another model")
        monkeypatch.setattr("motionenv.mocap.sources._RETRIES", 0)
        with pytest.raises(MotionError, match="sent other bytes"):
            read_models(None, tmp_path / "new", url)
        server.shutdown()


def test_weights_that_are_none(tmp_path):
    for name, content in (("text.task", b"no archive"), ("missing.whl", None)):
        if content:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(MotionError, match=f"can't read the weights .*{name}"):
            read_models(tmp_path / name, tmp_path)
    with pytest.raises(MotionError, match="must be a folder, .task or .whl that has pose_detection.tflite"):
        read_models(tmp_path, tmp_path)
    with pytest.raises(MotionError, match="--detector must be one of blazepose, rtmpose"):
        detector("openpose")


@pytest.mark.parametrize("side", [20, 61, 300])
def test_a_turned_square_is_sampled_as_scipy_does(side):
    """Where the square's pixels are as large as the picture's or smaller; beside the picture it's black."""
    rng = np.random.default_rng(side)
    picture = rng.integers(0, 255, (60, 80, 3)).astype(np.uint8)
    corner, axes = np.array([-5.0, 20.0]), np.array([[25.0, 15.0], [-15.0, 25.0]]) * (2 if side > 29 else 0.7)
    at = np.arange(side) + 0.5
    columns, rows = np.moveaxis(corner + (at[:, None, None] * axes[1] + at[:, None] * axes[0]) / side - 0.5, -1, 0)
    expected = [
        map_coordinates(picture[..., c] / 255, [rows, columns], order=1, mode="grid-constant") for c in range(3)
    ]
    np.testing.assert_allclose(module._sampled(picture, corner, axes, side), np.stack(expected, -1), atol=2e-6)


def test_a_smaller_picture_has_the_means_of_squares():
    picture = np.random.default_rng(0).integers(0, 255, (90, 62, 3)).astype(np.uint8)
    found = module._sampled(picture, np.zeros(2), np.eye(2) * 60, 20)
    np.testing.assert_allclose(found, picture[:60, :60].reshape(20, 3, 20, 3, 3).mean(axis=(1, 3)) / 255, atol=1e-6)


def test_faces_found_more_than_once_become_their_mean():
    """Against brute force on boxes that are far apart or all but the same."""
    rng = np.random.default_rng(1)
    middles = rng.permutation(np.array([[0.2, 0.2], [0.5, 0.7], [0.8, 0.3]]).repeat(4, axis=0))
    boxes = np.concatenate([middles[:, None], np.full((12, 1, 2), 0.1), rng.random((12, 4, 2))], axis=1)
    boxes[:, 0] += rng.normal(0, 0.005, (12, 2))
    scores = rng.uniform(0.5, 1, 12)
    found = np.array(module._suppressed(boxes, scores))
    assert len(found) == 3
    for one in found:
        mine = np.linalg.norm(boxes[:, 0] - one[0], axis=1) < 0.1
        np.testing.assert_allclose(one, (boxes[mine] * scores[mine, None, None]).sum(axis=0) / scores[mine].sum())


def test_peaks_of_heat_maps_move_points_to_them():
    rows, columns = np.indices((64, 64))
    peak = np.array([30.4, 20.7])
    heat = 9 - 2 * ((columns - peak[0]) ** 2 + (rows - peak[1]) ** 2)[..., None].repeat(3, axis=2)
    heat[..., 1] = -9  # no peak
    at = np.array([[31.5, 21.5], [31.5, 21.5], [90, 21.5]]) / 64
    found = module._refined(at, heat)
    np.testing.assert_allclose(found[0] * 64, peak, atol=0.1)
    np.testing.assert_array_equal(found[1:], at[1:])


def test_parts_cover_the_picture_and_overlap():
    for width, height in ((1920, 1080), (1080, 1920), (640, 480), (300, 300)):
        (corner, side), *parts = module._regions(width, height)
        assert side == max(width, height)
        np.testing.assert_allclose(2 * corner + side, [width, height])
        points = np.random.default_rng(0).uniform(0, [width, height], (500, 2))
        inside = [((points >= c) & (points <= c + s)).all(axis=1) for c, s in parts]
        assert np.any(inside, axis=0).all()
        assert any((one & other).any() for one, other in combinations(inside, 2))


def test_the_same_film_gives_the_same_points(blazepose):
    poses, skeleton = walk(0.12)
    pictures = [render(pose, skeleton, view(0.4, width=320, height=240, distance=5)).rgb for pose in poses]
    one, other = ([BlazePose(read_models(blazepose, blazepose.parent))(p) for p in pictures] for _ in range(2))
    np.testing.assert_array_equal(one, other)
