"""`motionenv track` as people type it."""

import json

import av
import numpy as np
import pytest

import motionenv
from motionenv.body import markers
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.mocap.keypoints.points2d import write_points
from motionenv.models.motion_tree import Clip, MotionTree, build_database
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.render.video.encode import write_video
from motionenv.types import Points

FAST = ("--particles", "60")


def pictures_in(path) -> tuple[int, tuple]:
    with av.open(str(path)) as container:
        shapes = [frame.to_ndarray(format="rgb24").shape for frame in container.decode(video=0)]
    return len(shapes), shapes[0]


@pytest.mark.parametrize("tracker", ["fpca", "constant-velocity"])
def test_an_environment_is_filmed_and_the_motion_written(run, tmp_path, tracker):
    result = run("track", "--env", "walker", "--tracker", tracker, "--start", "given", "--frames", 6, *FAST,
                 "--out", "track.mp4", "--motion", "walk.npz")  # fmt: skip
    assert result.code == 0, result.err
    assert float(result.out.split("frames, ")[1].split(" mm")[0]) < 250
    frames, shape = pictures_in(tmp_path / "track.mp4")
    assert frames == 6
    assert shape[1] == 2 * 384 + 4
    assert motionenv.read(tmp_path / "walk.npz").poses.shape == (6, 25)


def test_a_smoothed_track_is_nearer_to_the_truth_and_its_own(run, tmp_path):
    def told(*options):
        said = run("track", "--env", "walker", "--start", "given", "--particles", "300", "--frames", "40",
                   "--seed", "2", "--out", tmp_path / "t.gif", *options).out  # fmt: skip
        return float(said.split(" frames, ")[1].split(" mm")[0])

    filtered, smoothed = told(), told("--smooth")
    assert smoothed != filtered
    assert smoothed < 1.1 * filtered


def test_a_tree_out_of_a_file(run, tmp_path):
    walks = [synthesize("walk/fpca", 4, 30, seed=i, height=1.75) for i in range(8)]
    clips = [Clip(w, f"walk {i}", "walk", str(i)) for i, w in enumerate(walks)]
    MotionTree().fit_database(build_database(clips)).save(tmp_path / "walks.npz")
    result = run("track", "--env", "walker", "--tracker", "tree", "--model", "walks.npz", "--start", "given",
                 "--frames", 6, *FAST, "--out", "track.mp4")  # fmt: skip
    assert result.code == 0, result.err
    assert float(result.out.split("frames, ")[1].split(" mm")[0]) < 250


def test_an_arm_and_the_same_bytes_again(run, tmp_path):
    for env, name in (("arm", "one.gif"), ("motionenv/ArmTracking-v1", "two.gif")):
        result = run("track", "--env", env, "--tracker", "constant-velocity", "--start", "given", "--frames", 3,
                     *FAST, "--seed", 4, "--out", name)  # fmt: skip
        assert result.code == 0, result.err
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()


@pytest.mark.slow
def test_by_default_an_arm_is_followed_and_a_level_by_its_id(run, tmp_path):
    arm = run("track", "--env", "arm", "--frames", 3, "--particles", 60, "--out", "arm.gif")
    level = run("track", "--env", "motionenv/WalkerTracking-Easy-v1", "--start", "given", "--frames", 3, *FAST,
                "--out", "easy.gif")  # fmt: skip
    assert (arm.code, level.code) == (0, 0), arm.out + level.out
    assert "3 frames" in level.out


def test_who_is_lost_in_an_environment_is_said(run, tmp_path):
    result = run("track", "--env", "motionenv/WalkerTracking-Hard-v2", "--tracker", "constant-velocity", "--frames", 12,
                 "--particles", 20, "--out", "hard.gif")  # fmt: skip
    assert result.code == 3
    assert "LOST in " in result.err
    assert "of 12 frames" in result.err


@pytest.mark.usefixtures("blazepose")
def test_a_video_with_its_camera(run, tmp_path):
    walk = synthesize("walk/fpca", 1.5, 30, seed=3, height=1.75)
    poses = walk.poses - np.eye(25)[0] * walk.poses[:, :1].mean()
    camera = view(0.0, width=160, height=120, distance=4.5)
    write_video(tmp_path / "walk.mp4", render(poses, walk.skeleton, camera).rgb, 30)
    table = {"K": camera.K, "R": camera.R, "t": camera.t}
    (tmp_path / "camera.json").write_text(
        json.dumps({k: v.tolist() for k, v in table.items()} | {"width": 160, "height": 120})
    )
    result = run("track", "--video", "walk.mp4", "--camera", "camera.json", "--particles", "200",
                 "--out", "track.mp4", "--motion", "walk.npz")  # fmt: skip
    assert result.code == (3 if "LOST in frames" in result.err else 0), result.err
    assert int(result.out.split("track.mp4  ")[1].split(" of 45 frames followed")[0]) > 38
    assert "guessed" not in result.out
    assert float(result.out.split("outline ")[1].split()[0]) > 0.5
    assert pictures_in(tmp_path / "track.mp4") == (45, (480 + 96, 640 + 4 + 480, 3))  # four times as large
    motion = motionenv.read(tmp_path / "walk.npz")
    assert np.abs(np.nanmedian(motion.poses[:, 0] - poses[: len(motion.poses), 0])) < 0.3
    pixels = DetectorErrors().apply(Points(camera.project(markers(poses, walk.skeleton))[0], 30, "px"), 1)
    write_points(pixels, tmp_path / "points.csv")
    detected = ("--video", "walk.mp4", "--detections", "points.csv", "--camera", "camera.json")
    result = run("track", *detected, *FAST, "--out", "track.mp4", "--motion", "walk.npz")
    assert (result.code, "followed 1: seen from" in result.out) == (0, True), result.err
    motion = motionenv.read(tmp_path / "walk.npz")
    assert np.abs(motion.poses[:, 0] - poses[: len(motion.poses), 0]).max() < 0.3
    everybody = run("track", *detected, *FAST, "--person", "all", "--out", "track.mp4")
    assert (everybody.code, "followed 1: seen from" in everybody.out) == (0, True), everybody.err
    listed = run("track", *detected[:4], "--person", "list", "--out", "track.mp4")
    assert listed.out.startswith("1: seen from 0.0")


@pytest.mark.usefixtures("blazepose")
@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("--out", "t.mp4"), "--env"),
        (("--env", "motionenv/WalkerTracking-v0", "--out", "t.mp4"), "motionenv/WalkerTracking-v1"),
        (("--env", "walker", "--video", "empty.mp4", "--out", "t.mp4"), "one of them"),
        (("--env", "walker", "--out", "t.xyz"), "out must end in"),
        (("--env", "walker", "--out", "t.mp4", "--motion", "t.xyz"), "t.xyz"),
        (("--env", "walker", "--out", "none/t.mp4"), "folder"),
        (("--env", "walker", "--tracker", "magic", "--out", "t.mp4"), "magic"),
        (("--env", "walker", "--start", "late", "--out", "t.mp4"), "late"),
        (("--env", "walker", "--camera", "c.json", "--out", "t.mp4"), "--camera"),
        (("--env", "walker", "--seconds", "2", "--fps", "30", "--out", "t.mp4"), "--seconds, --fps: for --video"),
        (("--env", "walker", "--height", "1.8", "--out", "t.mp4"), "--height"),
        (("--video", "still.mp4", "--start", "given", "--frames", "5", "--out", "t.mp4"), "--start, --frames"),
        (("--video", "still.mp4", "--which", "1", "--out", "t.mp4"), "--which: needs --camera"),
        (("--video", "still.mp4", "--fps", "0", "--out", "t.mp4"), "fps"),
        (("--video", "still.mp4", "--weights", "a.task", "--out", "t.mp4"), "can't read the weights a.task"),
        (("--video", "still.mp4", "--detector", "eyes", "--out", "t.mp4"), "--detector must be one of"),
        (("--video", "still.mp4", "--detections", "p.json", "--out", "t.mp4"), "p.json"),
        (("--env", "walker", "--weights", "w", "--out", "t.mp4"), "--weights: for --video only"),
        (("--env", "walker", "--smooth", "--tracker", "tree", "--out", "t.mp4"), "--smooth needs --tracker fpca"),
        (("--env", "arm", "--smooth", "--out", "t.mp4"), "omit keep"),
        (("--env", "Nowhere-v0", "--out", "t.mp4"), "Nowhere-v0"),
        (("--env", "motionenv/MarkerTracking-v1", "--out", "t.mp4"), "MarkerTracking"),
        (("--env", "arm", "--start", "automatic", "--out", "t.mp4"), "arm's first pose can't be found"),
        (("--env", "arm", "--tracker", "tree", "--out", "t.mp4"), "--model"),
        (("--env", "walker", "--model", "nothing/there", "--out", "t.mp4"), "nothing/there"),
        (("--video", "empty.mp4", "--out", "t.mp4"), "empty.mp4"),
        (("--video", "none.mp4", "--out", "t.mp4"), "no such file"),
        (("--video", "text.mp4", "--out", "t.mp4"), "isn't a video"),
        (("--video", "still.mp4", "--out", "t.mp4"), "shows nobody in 12 frames"),
        (("--video", "still.mp4", "--camera", "none.json", "--out", "t.mp4"), "none.json"),
    ],
)
def test_what_is_wrong_is_told_in_a_line_and_nothing_is_left(run, tmp_path, args, says):
    (tmp_path / "empty.mp4").touch()
    (tmp_path / "text.mp4").write_text("no film at all\n" * 100)
    write_video(tmp_path / "still.mp4", np.full((12, 48, 64, 3), 90, dtype=np.uint8), 30)
    before = set(tmp_path.iterdir())
    result = run("track", *args)
    assert result.code == 2, result.out
    assert result.err.count("\n") == 1, result.err
    assert says in result.err
    assert set(tmp_path.iterdir()) == before
