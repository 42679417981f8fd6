"""Trees from folders of capture, and their cards."""

import numpy as np
import pytest

import motionenv
from motionenv.errors import MotionError
from motionenv.models.motion_tree.training import fit_tree
from motionenv.types import Motion


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
    with pytest.raises(MotionError, match="no AMC, BVH, C3D, NPZ or TRC file below"):
        fit_tree(folder / "nowhere")
