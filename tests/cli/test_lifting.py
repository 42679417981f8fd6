"""`motionenv lift` as people type it."""

import json
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import motionenv
from motionenv.body import markers
from motionenv.lifting import project_markers
from motionenv.metrics import pelvis_mpjpe
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.mocap.keypoints.points2d import write_points
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.models.paths import WalkPath
from motionenv.models.synthesis import synthesize
from motionenv.render.cameras import fit_view
from motionenv.render.video.encode import write_video
from motionenv.types import MARKERS, Markers, Points

COCO = ("left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
        "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle")  # fmt: skip


@pytest.fixture(scope="module")
def walked():
    motion = synthesize("walk/fpca", 3, 30, seed=7)
    return motion, Markers(MARKERS, markers(motion.poses, motion.skeleton), 30.0)


def test_a_table_becomes_motion_and_a_picture(run, walked, tmp_path):
    write_points(project_markers(walked[1], np.radians(35)), tmp_path / "points.csv")
    result = run("lift", "points.csv", "--out", "walk.npz", "--plot", "walk.png")
    assert result.code == 0, result.err
    assert "view 3" in result.out
    assert "truth" not in result.out
    motion = motionenv.read(tmp_path / "walk.npz")
    assert motion.poses.shape == (90, 25)
    assert (tmp_path / "walk.png").read_bytes().startswith(b"\x89PNG")


def test_coco_keypoints_in_pixels(run, walked, tmp_path):
    shown = 300 * project_markers(walked[1], np.radians(60)).positions * [1, -1] + [900, 700]
    people = []
    for i, frame in enumerate(shown):
        at = dict(zip(MARKERS, frame, strict=True))
        head = at["head"].tolist()
        keypoints = [*head, 0.9, *([0, 0, 0] * 2), *head, 0.9, *head, 0.9]
        keypoints += [n for name in COCO for n in (*at[name].tolist(), 0.9)]
        people.append({"image_id": i, "category_id": 1, "score": 0.9, "keypoints": keypoints})
    (tmp_path / "people.json").write_text(json.dumps(people))
    result = run(
        "lift", "people.json", "--fps", "30", "--method", "steady", "--elevation", "unknown", "--out", "walk.bvh"
    )
    assert result.code == 0, result.err
    view = float(result.out.split("view ")[1].split(" ")[0])
    assert view == pytest.approx(60, abs=8)
    assert (tmp_path / "walk.bvh").stat().st_size > 1000


def test_a_folder_of_a_detector_with_its_errors(run, walked, tmp_path):
    """OpenPose's BODY_25 relative to the picture, one file per frame, of a walker seen by a detector that errs."""
    pixels = 300 * project_markers(walked[1], np.radians(60)).positions * [1, -1] + [900, 700]
    seen = DetectorErrors().apply(Points(pixels, 30, "px"), rng=1)
    names = KEYPOINT_SETS["body-25"].keypoints
    (tmp_path / "json").mkdir()
    for i, (frame, sure) in enumerate(zip(seen.positions / [1920, 1080], seen.confidence, strict=True)):
        at = dict(zip(MARKERS, np.column_stack([np.nan_to_num(frame), sure]).tolist(), strict=True))
        at |= {"left_ear": at["head"], "right_ear": at["head"]}
        flat = [value for name in names for value in at.get(name, [0.0, 0.0, 0.0])]
        people = [{"person_id": [-1], "pose_keypoints_2d": flat}]
        (tmp_path / "json" / f"cam_{i:012d}_keypoints.json").write_text(json.dumps({"people": people}))
    common = ("lift", "json", "--fps", "30", "--method", "steady", "--elevation", "unknown", "--out", "walk.bvh")
    result = run(*common, "--format", "body-25", "--size", "1920x1080")
    assert result.code == 0, result.err
    assert float(result.out.split("view ")[1].split(" ")[0]) == pytest.approx(60, abs=15)
    wrong = {(): "--size", ("--size", "1920"): "WIDTHxHEIGHT", ("--size", "1920x1080", "--format", "coco"): "body-25"}
    for args, says in wrong.items():
        result = run(*common, *args)
        assert result.code == 2
        assert says in result.err


def test_capture_is_projected_and_compared(run, walked, tmp_path):
    motionenv.write(walked[0], tmp_path / "walk.c3d")
    result = run("lift", "walk.c3d", "--project", "30", "--view", "unknown", "--out", "again.glb")
    assert result.code == 0, result.err
    error = float(result.out.split("against the truth: ")[1].split(" mm")[0])
    assert error < 40


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("points.csv", "--out", "walk.xyz"), "walk.xyz"),
        (("points.csv", "--out", "walk.npz", "--view", "above"), "above"),
        (("points.csv", "--out", "walk.npz", "--elevation", "much"), "elevation"),
        (("points.csv", "--out", "walk.npz", "--project", "30"), "--project"),
        (("walk.npz", "--out", "again.npz", "--project", "30"), "poses"),
        (("walk.npz", "--out", "again.npz"), "--project"),
        (("people.json", "--out", "walk.npz"), "fps"),
        (("points.csv", "--out", "again.npz", "--plot", "walk.xyz"), "plot"),
        (("points.csv", "--out", "again.npz", "--plot", "walk"), "plot"),
        (("points.csv", "--out", "again.npz", "--person", "1"), "person"),
        (("none.json", "--out", "again.npz", "--fps", "30"), "motionenv: none.json: can't be read"),
        (("walk.npz", "--out", "again.npz", "--person", "1"), "--person"),
        (("walk.npz", "--out", "again.npz", "--size", "640x480"), "--size"),
        (("walk.trc", "--out", "again.npz"), "--project"),
    ],
)
def test_what_is_wrong_is_told_in_a_line_and_nothing_is_left(run, walked, tmp_path, args, says):
    motionenv.write(walked[0], tmp_path / "walk.npz")
    motionenv.write(walked[0], tmp_path / "walk.trc")
    write_points(project_markers(walked[1], 0.5), tmp_path / "points.csv")
    (tmp_path / "people.json").write_text("[]")
    before = set(tmp_path.iterdir())
    result = run("lift", *args)
    assert result.code == 2
    assert result.err.count("\n") == 1
    assert says in result.err
    assert set(tmp_path.iterdir()) == before


@pytest.fixture(scope="module")
def turning():
    """Somebody who turns, and a camera that sees it."""
    motion = synthesize("walk/fpca", 9, 30, seed=4, path=WalkPath.arc(1.6, 20.0), speed=1.1)
    places = markers(motion.poses, motion.skeleton)
    return places, fit_view(places, 0.4, width=640, height=480, elevation=0.12)


def test_somebody_who_turns_before_a_calibrated_camera(run, turning, tmp_path):
    places, camera = turning
    vector = Rotation.from_matrix(camera.R).as_rotvec().tolist()
    (tmp_path / "calibration.toml").write_text(
        f"[left]\nsize = [640, 480]\nmatrix = {camera.K.tolist()}\nrotation = {vector}\n"
        f"translation = {camera.t.tolist()}\ndistortions = [0.0, 0.0, 0.0, 0.0]\n"
    )
    write_points(Points(camera.project(places)[0], 30, "px"), tmp_path / "points.csv")
    told = ["--camera", "calibration.toml", "--out", "walk.npz", "--plot", "walk.png"]
    result = run("lift", "points.csv", *told)
    assert result.code == 0, result.err
    assert "free motion; the body turns by" in result.out
    motion = motionenv.read(tmp_path / "walk.npz")
    assert pelvis_mpjpe(markers(motion.poses, motion.skeleton), places).mean() < 0.05
    assert (tmp_path / "walk.png").read_bytes().startswith(b"\x89PNG")
    assert "--which needs --camera" in run("lift", "points.csv", "--which", "left", "--out", "a.npz").err


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".c3d", ".trc"])
def test_somebody_who_leaves_and_comes_back(run, turning, tmp_path, suffix):
    places, camera = turning
    pixels = camera.project(places)[0]
    pixels[90:180] = np.nan
    write_points(Points(pixels, 30, "px"), tmp_path / "points.csv")
    result = run("lift", "points.csv", "--out", f"walk{suffix}")
    assert result.code == 0, result.err
    assert "3.0 to 6.0 s: nobody is seen" in result.out
    assert (tmp_path / f"walk{suffix}").stat().st_size > 1000
    refused = run("lift", "points.csv", "--out", "walk.bvh")
    assert "nobody is seen at times from 3.0 to 6.0 s, which .bvh can't represent: write .c3d, .csv" in refused.err
    assert not (tmp_path / "walk.bvh").exists()


def test_a_film_is_detected_and_what_it_lacks_is_told(run, tmp_path, monkeypatch):
    write_video(tmp_path / "film.mp4", np.full((6, 48, 64, 3), 90, dtype=np.uint8), 30)
    monkeypatch.setitem(sys.modules, "rtmlib", None)
    for args, says in (
        (("film.mp4",), "is missing: pip install 'motionenv[detect]'"),
        (("film.mp4", "--fps", "30"), "--fps is only for files of points; film.mp4 is a film: omit it"),
        (("points.csv", "--weights", "a.onnx", "b.onnx"), "--weights is only for films"),
        (("none.mp4",), "there is no such file"),
    ):
        result = run("lift", *args, "--out", "walk.bvh")
        assert (result.code, says in result.err.replace("\n", " ")) == (2, True), result.err


def test_a_report_and_a_table_of_angles(run, walked, tmp_path):
    camera = fit_view(walked[1].positions, 0.2, width=640, height=480)
    write_points(Points(camera.project(walked[1].positions)[0], 30, "px"), tmp_path / "points.csv")
    common = ("lift", "points.csv", "--out", "walk.npz", "--height", "1.8")
    result = run(*common, "--report", "walk.html", "--angles", "angles.csv")
    assert result.code == 0, result.err
    assert "strides, speed" in result.out
    assert "angles.csv  " in result.out
    assert "person&#x27;s height, 1.80 m" in (tmp_path / "walk.html").read_text()
    assert (tmp_path / "angles.csv").read_text().startswith("time_s,angle,degrees,low,high\n0.0000,")
    with np.load(tmp_path / "walk.npz") as file:
        assert file["band"].shape == (90, 15, 3)
    for option, name in (("--report", "walk.pdf"), ("--angles", "angles.xlsx")):
        assert "must end in" in run(*common, option, name).err
    assert "height must be" in run("lift", "points.csv", "--out", "walk.npz", "--height", "18").err
