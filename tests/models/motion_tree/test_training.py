"""Clips from folders: what file names tell of them; trees fitted to them, and their cards."""

import numpy as np
import pytest

import motionenv
from motionenv.errors import MotionError
from motionenv.models.motion_tree.training import fit_tree, read_clips
from motionenv.types import Motion


def test_capture_is_read_with_tags_from_its_names(mocap):
    folder = mocap / "bandai_namco" / "Bandai-Namco-Research-Motiondataset-1"
    names = []
    clips = []
    for clip in read_clips(folder, unit="cm", on_file=names.append):
        clips.append(clip)
        if len(clips) == 3:
            break
    assert len(names) == 3  # one at a time, not all at first
    assert all(clip.name.split("_")[1:3] == [clip.activity, clip.person] for clip in clips)
    assert all(clip.motion.fps == pytest.approx(30, rel=1e-4) for clip in clips)


def test_files_that_are_no_capture_are_left_out(tmp_path):
    (tmp_path / "walk").mkdir()
    (tmp_path / "walk" / "ann_1.bvh").write_text("no hierarchy")
    motion = motionenv.load("walk/fpca").synthesize(seconds=1, fps=30, seed=1)
    motionenv.write(motion, tmp_path / "walk" / "bob_2.npz")
    left_out = {}
    (clip,) = read_clips(tmp_path, on_left_out=left_out.__setitem__)
    assert (clip.activity, clip.person) == ("walk", "bob")
    assert list(left_out) == ["ann_1.bvh"]
    with pytest.raises(MotionError, match="no capture "):
        next(read_clips(tmp_path / "nowhere"))


def test_an_activity_that_is_told_goes_before_that_of_the_folder(tmp_path, stranger):
    (tmp_path / "strolling").mkdir()
    motionenv.write(stranger, tmp_path / "strolling" / "ann_1.npz")
    motionenv.write(stranger, tmp_path / "bob.npz")
    told = {(clip.name, clip.activity, clip.person) for clip in read_clips(tmp_path)}
    assert told == {("ann_1.npz", "strolling", "ann"), ("bob.npz", tmp_path.name, "bob")}
    assert {clip.activity for clip in read_clips(tmp_path, activity="walk")} == {"walk"}


def test_a_rate_that_is_told_is_not_for_files_that_state_theirs(tmp_path, stranger):
    motionenv.write(stranger, tmp_path / "a.npz")
    motionenv.write(stranger, tmp_path / "a.c3d")
    npz, c3d = sorted(read_clips(tmp_path, fps=120.0), key=lambda clip: clip.name, reverse=True)
    assert (npz.motion.fps, c3d.motion.fps) == (30.0, 30.0)
    assert npz.motion.poses.tobytes() == stranger.poses.tobytes()


def test_a_unit_that_is_told_is_not_for_files_that_state_theirs(tmp_path, stranger):
    motionenv.write(stranger, tmp_path / "a.c3d")  # in millimetres, and says so
    (told,) = read_clips(tmp_path, unit="m")
    (untold,) = read_clips(tmp_path)
    assert told.motion.poses.tobytes() == untold.motion.poses.tobytes()


def test_people_of_any_alphabet_are_people(tmp_path, stranger):
    for name in ("Пётр_01", "Иван_01", "Zoe\u0308_1", "Zo\u00eb_2"):
        motionenv.write(stranger, tmp_path / f"{name}.npz")
    assert {clip.person for clip in read_clips(tmp_path)} == {"Пётр", "Иван", "Zo\u00eb"}


def test_captures_of_part_of_the_body_are_left_out_or_filled(tmp_path):
    walk = motionenv.synthesize("walk/fpca", 1.0, 30.0, seed=1)
    poses = walk.poses.copy()
    poses[:, 9:13] = np.nan
    (tmp_path / "walk").mkdir()
    motionenv.write(motionenv.Motion(poses, walk.skeleton, walk.fps), tmp_path / "walk" / "a_1.npz")
    why = {}
    assert not list(read_clips(tmp_path, on_left_out=why.__setitem__))
    assert "a clip needs the left arm" in why["a_1.npz"]
    (clip,) = read_clips(tmp_path, fill=True)
    assert np.isfinite(clip.motion.poses).all()


@pytest.fixture
def folder(tmp_path, stranger):
    """A walk of two seconds, one of eight frames, and a file that is none."""
    for name, frames in (("ann_1", 60), ("bob_1", 8)):
        (tmp_path / "walk").mkdir(exist_ok=True)
        motionenv.write(Motion(stranger.poses[:frames], stranger.skeleton, 30.0), tmp_path / "walk" / f"{name}.npz")
    (tmp_path / "walk" / "notes.bvh").write_text("HIERARCHY\n")
    return tmp_path


def test_the_card_tells_what_it_was_fitted_to_and_what_was_left_out(folder):
    left_out, files = {}, []
    tree = fit_tree(folder, command="the command", on_file=files.append, on_left_out=left_out.__setitem__)
    assert files == ["ann_1.npz", "bob_1.npz", "notes.bvh"]
    assert left_out["bob_1.npz"] == "has no 11 contiguous frames at 30 frames/s"
    assert set(left_out) == {"bob_1.npz", "notes.bvh"}
    card = tree.card_
    assert (card["people"], card["clips"], card["activities"], card["command"]) == (1, 1, "walk", "the command")
    assert (card["frames"], card["windows"]) == (60, len(tree.frames_)) == (60, 50)


def test_mirror_images_double_the_frames_and_an_activity_can_be_told(folder):
    tree = fit_tree(folder, mirrored=True, activity="gait")
    assert tree.card_["frames"] == 120
    assert tree.activities == ("gait",)
    assert np.count_nonzero(tree.database_.mirrored) == 1


def test_a_folder_of_which_nothing_can_be_used_names_the_first_file_and_why(folder):
    (folder / "walk" / "ann_1.npz").unlink()
    with pytest.raises(MotionError, match=r"none of 2 files .* the first, (notes\.bvh|bob_1\.npz: has no 11)"):
        fit_tree(folder)
    with pytest.raises(MotionError, match="no capture "):
        fit_tree(folder / "nowhere")
