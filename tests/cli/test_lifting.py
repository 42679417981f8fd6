"""`motionenv lift` as people type it."""

import json
import sys

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

import motionenv
from motionenv.body import markers
from motionenv.cli.lifting import _steadied
from motionenv.lifting import project_markers
from motionenv.metrics import pelvis_mpjpe
from motionenv.mocap import to_markers
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.mocap.keypoints.points2d import write_points
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.models.paths import WalkPath
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import fit_view, view
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
    assert "the body turns by" in result.out
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
    result = run("lift", "people.json", "--fps", "30", "--elevation", "unknown", "--out", "walk.bvh")
    assert result.code == 0, result.err
    assert "warning" not in result.out
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
    common = ("lift", "json", "--fps", "30", "--elevation", "unknown", "--out", "walk.bvh")
    result = run(*common, "--format", "body-25", "--size", "1920x1080")
    assert result.code == 0, result.err
    assert "the body turns by" in result.out
    wrong = {(): "--size", ("--size", "1920"): "WIDTHxHEIGHT", ("--size", "1920x1080", "--format", "coco"): "body-25"}
    for args, says in wrong.items():
        result = run(*common, *args)
        assert result.code == 2
        assert says in result.err


def test_capture_is_projected_and_compared(run, walked, tmp_path):
    motionenv.write(walked[0], tmp_path / "walk.c3d")
    result = run("lift", "walk.c3d", "--project", "30", "--out", "again.glb")
    assert result.code == 0, result.err
    error = float(result.out.split("against the truth: ")[1].split(" mm")[0])
    assert error < 40


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("points.csv", "--out", "walk.xyz"), "walk.xyz"),
        (("points.csv", "--out", "walk.npz", "--height", "9"), "height"),
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
    (tmp_path / "people.json").write_text(json.dumps([{"image_id": 0, "keypoints": [9.0] * 51}]))
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
    assert "the body turns by" in result.out
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
    monkeypatch.setitem(sys.modules, "ai_edge_litert.interpreter", None)
    (tmp_path / "pose_detection.tflite").write_bytes(b"")
    (tmp_path / "pose_landmark_full.tflite").write_bytes(b"")
    for args, says in (
        (("film.mp4", "--weights", "."), "is missing: pip install 'motionenv[detect]'"),
        (("film.mp4", "--unit", "mm"), "--unit is only for files of points; film.mp4 is a film: omit it"),
        (("film.mp4", "--fps", "0"), "fps must be"),
        (("film.mp4", "--person", "0;3"), "--person must be a number, or those of the parts of one person"),
        (("points.csv", "--weights", "a.task"), "--weights is for films"),
        (("none.mp4",), "there is no such file"),
    ):
        result = run("lift", *args, "--out", "walk.bvh")
        assert (result.code, says in result.err.replace("\n", " ")) == (2, True), result.err


def test_turns_of_a_films_camera_are_taken_out_and_others_are_told(tmp_path, capsys):
    rng = np.random.default_rng(5)
    wall = gaussian_filter(rng.standard_normal((300, 500)), 2)
    wall = 128 + 40 * wall / wall.std()
    detected = np.column_stack([rng.uniform(60, 90, (15, 2)), np.ones(15)])
    points = Points(np.tile(detected[:, :2], (20, 1, 1)), 20, "px")
    for shift, says in ((0.0, ""), (2.0, "the camera turns by up to"), (None, "too little structure")):
        left = np.round((shift or 0) * np.arange(20)).astype(int)
        seen = np.stack([wall[50:242, 100 + x : 356 + x] for x in left]) * (shift is not None)
        film = np.repeat(seen[..., None], 3, axis=-1).clip(0, 255).astype(np.uint8)
        write_video(tmp_path / "film.mp4", film, 20)
        steady, known = _steadied(tmp_path / "film.mp4", [dict.fromkeys(range(20), detected)], points, {})
        assert says in " ".join(capsys.readouterr().err.split())
        moved = (steady.positions - points.positions).mean(axis=1)
        if shift:
            np.testing.assert_allclose(np.diff(moved[:, 0]), shift, atol=0.4)
            assert known["camera"].shape == (3, 3)
        else:
            assert (steady is points, known) == (True, {})


def coco(places: np.ndarray, camera, seen: tuple[str, ...] = COCO, score=0.9) -> list[dict]:
    """COCO's results of somebody of whom a camera sees some keypoints, all others at (0, 0) with a score."""
    pixels = camera.project(places)[0]
    names = KEYPOINT_SETS["coco-17"].keypoints
    out = []
    for t, frame in enumerate(pixels):
        at = dict(zip(MARKERS, frame.tolist(), strict=True))
        at |= {name: at["head"] for name in ("left_ear", "right_ear", "nose")}
        flat = [v for name in names for v in ([*at[name], score] if name in seen else [0.0, 0.0, score])]
        out.append({"image_id": f"take 2_{t:05d}_cam1.jpg", "category_id": 1, "keypoints": flat})
    return out


LEGS = tuple(name for name in COCO if any(part in name for part in ("hip", "knee", "ankle")))


@pytest.mark.parametrize("shown", ["all", "legs", "trunk", "sitting"])
def test_bands_are_sane_or_not_there(run, turning, tmp_path, shown):
    places, camera = turning
    places = places[:120]
    if shown == "sitting":
        places = np.repeat(places[:1], 120, axis=0) + np.random.default_rng(0).normal(0, 0.3, (120, 15, 1))
    seen = {"legs": LEGS, "trunk": tuple(name for name in COCO if name not in LEGS[2:])}.get(shown, (*COCO, "left_ear"))
    (tmp_path / "walk.json").write_text(json.dumps(coco(places, camera, seen, 1.0)))
    result = run("lift", "walk.json", "--fps", "30", "--out", "walk.csv")
    assert result.code == 0, result.err
    assert result.err == ""  # no library's warning
    assert "nan" not in result.out
    if shown in ("all", "legs"):
        assert 20 < float(result.out.split("joints ± ")[1].split(" mm")[0]) < 90
        assert "warning" not in result.out
    else:
        assert "joints ±" not in result.out
        assert "warning: too little of the person shows" in result.out or "unlike the people" in result.out
    if shown == "legs":
        assert "frames 0-119: head, sternum, left_shoulder" in result.out
    assert ("any marker, for want of a leg" in result.out) == (shown == "trunk")


def test_somebody_who_stands_on_the_head_is_told_how_to_stand(run, turning, tmp_path):
    places, camera = turning
    people = coco(places[:90], camera, (*COCO, "left_ear", "right_ear", "nose"))
    (tmp_path / "down.json").write_text(json.dumps(people))
    for entry in people:
        entry["keypoints"][1::3] = [480 - y for y in entry["keypoints"][1::3]]
    (tmp_path / "up.json").write_text(json.dumps(people))
    told = ("--fps", "30", "--out", "walk.csv")
    assert "stands on the head" in (refused := run("lift", "up.json", *told)).err
    assert refused.code == 2
    assert "(--up)" in refused.err
    fixed, usual = (run("lift", *how, *told) for how in (("up.json", "--up", "--size", "640x480"), ("down.json",)))
    assert fixed.code == 0, fixed.err
    assert fixed.out == usual.out
    for how in (("--camera", "c.toml"),):
        (tmp_path / "c.toml").write_text(
            f"[left]\nsize = [640, 480]\nmatrix = {camera.K.tolist()}\nrotation = [0.0, 0.0, 0.0]\n"
            "translation = [0.0, 0.0, 0.0]\ndistortions = [0.0, 0.0, 0.0, 0.0]\n"
        )
        assert "needs --size" in run("lift", "up.json", "--up", *how, *told).err


def test_arrays_and_tables_of_other_programs(run, turning, tmp_path):
    places, camera = turning
    pixels = camera.project(places[:60])[0]
    names = KEYPOINT_SETS["human36m-17"].keypoints
    at = dict(zip(MARKERS, np.moveaxis(pixels, 1, 0), strict=True))
    at |= {"mid_hip": at["pelvis"], "thorax": at["sternum"], "spine": at["sternum"], "upper_neck": at["head"]}
    at["head_top"] = at["head"]
    array = np.stack([at[name] for name in names], axis=1)
    np.savez(tmp_path / "data_2d_custom_walk.npz", positions_2d={"walk.mp4": {"custom": [array]}})
    np.save(tmp_path / "walk.npy", array)
    header = "track,frame_idx,instance.score," + ",".join(f"{n}.x,{n}.y,{n}.score" for n in names)
    rows = [f",{t},1," + ",".join(f"{x},{y},1" for x, y in frame) for t, frame in enumerate(array)]
    (tmp_path / "walk.analysis.csv").write_text("\r\n".join([header, *rows]) + "\r\n")
    told = {run("lift", name, "--fps", "30", "--out", "w.csv").out.split("\n")[1] for name in
            ("data_2d_custom_walk.npz", "walk.npy", "walk.analysis.csv")}  # fmt: skip
    assert len(told) == 1
    assert "the body turns by" in told.pop()
    assert "has 2D points" in run("lift", "walk.npy", "--fps", "30", "--project", "30", "--out", "w.csv").err
    (tmp_path / "walk.h5").write_bytes(b"\x89HDF")
    assert "export CSV" in run("lift", "walk.h5", "--fps", "30", "--out", "w.csv").err


@pytest.mark.slow
def test_a_film_goes_from_pixels_to_a_lifted_walk(run, tmp_path, blazepose):
    """A rendered walker in slow motion, whom the camera sees obliquely: what is lifted is near the truth."""
    made = synthesize("walk/fpca", seconds=2.0, fps=25, seed=22, height=1.75)
    poses = made.poses - np.eye(25)[0] * made.poses[:, :1].mean()
    camera = view(0.6, width=640, height=480, distance=5)
    film = (render(pose, made.skeleton, camera).rgb for pose in poses)
    write_video(tmp_path / "film.mp4", film, 12.5)
    told = {name: getattr(camera, name).tolist() for name in "KRt"} | {"width": camera.width, "height": camera.height}
    (tmp_path / "camera.json").write_text(json.dumps(told))
    args = ("--weights", blazepose, "--camera", "camera.json", "--fps", "25", "--out", "walk.npz")
    result = run("lift", "film.mp4", *args)
    assert result.code == 0, result.err
    assert "film.mp4: 50 frames at 12.5 fps; blazepose found 1 people, 0: in 50 frames from 0" in result.err
    found = motionenv.read(tmp_path / "walk.npz")
    assert found.fps == 25
    true, got = markers(poses, made.skeleton), markers(found.poses, found.skeleton)
    off = np.linalg.norm(got - got[:, 2:3] - true + true[:, 2:3], axis=-1)
    assert np.nanmean(off) < 0.09


def test_a_picture_that_was_made_narrower_is_doubted(run, mocap, tmp_path):
    walk = to_markers(motionenv.read(mocap / "cmu_asfamc/07/07_01.amc", fps=120)).positions[::4]
    seen = fit_view(walk, 0.6, elevation=0.1).project(walk)[0]
    for ratio, doubted in ((1, False), (9 / 16, True)):
        write_points(Points(seen * [ratio, 1], 30, "px"), tmp_path / "points.csv")
        result = run("lift", "points.csv", "--elevation", "6", "--out", "walk.npz")
        assert ("warning: people look as if their picture had been made narrower" in result.out) == doubted, result.out


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
