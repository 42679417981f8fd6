"""`motionenv fit` and `motionenv models` as people type them."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import motionenv
from tests.cli.talking import refused


def test_models_are_listed_with_their_cards(run):
    result = run("models")
    assert result.code == 0
    for name in ("walk/fpca", "walk/eigenwalkers", "walk/prior"):
        assert name in result.out
    assert result.out.count("model licence: MIT") == 4
    assert result.out.count("command: motionenv fit") == 3
    assert "mixed/tree\n    model: mixed/tree\n    people: 48" in result.out


def test_a_model_is_described_and_drawn(run, tmp_path):
    result = run("models", "describe", "walk/fpca", "--out", "c.png")
    assert (result.code, (tmp_path / "c.png").read_bytes()[:4]) == (0, b"\x89PNG"), result.err
    shares = [float(share) for share in re.findall(r"component \d+: ([\d.]+)% of variance", result.out)]
    assert shares == pytest.approx(100 * motionenv.load("walk/fpca").components().shares, abs=0.06)
    assert "    people: 11\n" in result.out
    refused(
        run("models", "describe", "walk/fpca", "--out", "c.tiff"), "--out must end in .pdf, .png or .svg, got c.tiff"
    )
    refused(run("models", "describe", "mixed/tree", "--out", "c.png"), "tree models don't have: omit it")
    refused(run("models", "describe", "walk/fcpa"), "did you mean walk/fpca?")


def test_fit_learns_a_model_that_walks(run, mocap, tmp_path):
    for trial in ("07/07_01", "07/07_02", "07/07_03", "35/35_01", "35/35_02", "16/16_15", "16/16_21"):
        for suffix in (f"{trial}.amc", f"{trial[:2]}/{trial[:2]}.asf"):
            (tmp_path / "walks" / trial[:2]).mkdir(parents=True, exist_ok=True)
            shutil.copy(mocap / "cmu_asfamc" / suffix, tmp_path / "walks" / suffix)
    (tmp_path / "walks" / "broken.bvh").write_text("HIERARCHY\n")
    result = run("fit", "walk/fpca", "--mocap", "walks", "--fps", 120, "--out", "m.npz")
    assert (result.code, result.out) == (0, "m.npz  7 walks of 3 people\n")
    assert "left out broken.bvh: " in result.err
    assert run("synth", "m.npz", "--seconds", 1, "--out", "w.bvh").code == 0
    card = motionenv.load(tmp_path / "m.npz").card_
    assert card["command"] == "motionenv fit walk/fpca --mocap walks --fps 120 --out m.npz"
    assert (card["people"], card["trials"]) == (3, 7)


def test_eigenwalkers_learn_the_axis_between_two_groups(run, tmp_path):
    for i in range(5):
        (tmp_path / "walks").mkdir(exist_ok=True)
        walk = motionenv.synthesize("walk/fpca", 5, 60, seed=i, speed=1.0 if i < 2 else 1.6)
        motionenv.write(walk, tmp_path / "walks" / f"p{i}_1.npz")
    groups = "--group", "slow=p0,p1", "--group", "fast=p2, p3"
    result = run("fit", "walk/eigenwalkers", "--mocap", "walks", *groups, "--out", "m.npz")
    assert result.code == 0, result.err
    assert "of 2 slow" in result.err
    trait = motionenv.load(tmp_path / "m.npz").traits()[0]
    assert (trait.low, trait.high) == ("slow", "fast")
    fit = "fit", "walk/eigenwalkers", "--mocap", "walks", "--out", "n.npz"
    refused(run(*fit, "--group", "slow=p0,p1"), "--group is NAME=PERSON,PERSON,… with two names")
    refused(run(*fit, "--group", "slow=p0,p1", "--group", "fast=p2,p9"), "no walk of p9")
    refused(
        run("fit", "walk/fpca", "--mocap", "walks", *groups, "--out", "n.npz"), "--group is only for walk/eigenwalkers"
    )
    assert not (tmp_path / "n.npz").exists()


def test_a_model_of_another_version_is_refused(run, monkeypatch, tmp_path):
    from motionenv.models.storage import model_file as store

    arrays_and_meta = motionenv.load("walk/fpca").to_arrays()
    with monkeypatch.context() as patch:
        patch.setattr(store, "FORMAT_VERSION", store.FORMAT_VERSION + 1)
        store.save_model(tmp_path / "future.npz", "walking", *arrays_and_meta)
    refused(run("synth", "future.npz", "--out", "w.npz"), "format")
    assert [p.name for p in tmp_path.iterdir()] == ["future.npz"]


def test_a_motion_is_no_model(run, walk):
    refused(run("synth", walk, "--out", "w.npz"), "not a motionenv model")


CLIPS = [
    "dataset-1_walk_normal_001.bvh", "dataset-1_walk_active_001.bvh", "dataset-1_run_normal_001.bvh",
]  # fmt: skip


@pytest.fixture
def clips(mocap, tmp_path) -> Path:
    """A folder with three clips of capture and a file that is none."""
    (tmp_path / "clips").mkdir()
    for name in CLIPS:
        shutil.copy(next((mocap / "bandai_namco").rglob(name)), tmp_path / "clips")
    (tmp_path / "clips" / "broken.bvh").write_text("HIERARCHY\n")
    return tmp_path / "clips"


def test_fit_tree_mirrored_and_with_an_activity(run, clips, tmp_path):
    options = ["--mirrored", "--activity", "gait", "--fps", 30]
    assert run("fit", "tree", "--mocap", "clips", "--out", "mine.npz", *options).code == 0
    tree = motionenv.load(tmp_path / "mine.npz")
    assert tree.database_.mirrored.sum() == 3
    assert set(tree.database_.activities) == {"gait"}
    assert tree.card_["command"].endswith("clips --fps 30 --activity gait --mirrored --out mine.npz")


def test_fit_tree_learns_what_sample_goes_on_from(run, clips, tmp_path):
    result = run("fit", "tree", "--mocap", "clips", "--out", "mine.npz")
    assert result.code == 0
    assert "left out broken.bvh: " in result.err
    tree = motionenv.load(tmp_path / "mine.npz")
    assert result.out.startswith(f"mine.npz  3 clips, {len(tree.database_.poses)} frames, {len(tree.frames_)} windows;")
    assert set(tree.database_.clips) == set(CLIPS)
    assert (tree.card_["people"], tree.card_["activities"]) == (2, "run, walk")
    assert tree.card_["command"] == "motionenv fit tree --mocap clips --out mine.npz"
    made = run("sample", "--tree", "mine.npz", "--start", "run", "--seconds", 2, "--out", "run.npz")
    assert (made.code, made.out) == (0, "run.npz  60 frames, 2 s at 30 fps\n")
    assert np.isfinite(motionenv.read(tmp_path / "run.npz").poses).all()
    refused(run("sample", "--tree", "mine.npz", "--start", "swim", "--out", "x.npz"), "run, walk")


def test_fit_tree_without_capture_leaves_nothing(run, tmp_path):
    refused(run("fit", "tree", "--mocap", ".", "--out", "m.npz"), "no capture ")
    refused(run("fit", "tree", "--mocap", ".", "--out", "nowhere/m.npz"), "nowhere")
    refused(run("fit", "walk/fpca", "--mocap", ".", "--out", "m.npz", "--mirrored"), "only for tree")
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n")
    result = run("fit", "tree", "--mocap", ".", "--out", "m.npz")
    assert result.code == 2
    assert "none of 1 files can be used; the first, broken.bvh" in " ".join(result.err.split())
    assert [p.name for p in tmp_path.iterdir()] == ["broken.bvh"]


def test_fit_takes_lower_bodies_and_fills_them_on_request(run, tmp_path):
    (tmp_path / "walks").mkdir()
    for seed in range(6):
        walk = motionenv.synthesize("walk/fpca", 4.0, 40.0, seed=seed)
        poses = walk.poses.copy()
        poses[:, 6:17] = np.nan
        motionenv.write(motionenv.Motion(poses, walk.skeleton, walk.fps), tmp_path / "walks" / f"{seed}_1.npz")
    assert run("fit", "walk/fpca", "--mocap", "walks", "--out", "legs.npz").code == 0
    assert run("synth", "legs.npz", "--seconds", 1, "--out", "legs-walk.npz").code == 0
    assert np.isnan(motionenv.read(tmp_path / "legs-walk.npz").poses[:, 6:17]).all()
    tree = run("fit", "tree", "--mocap", "walks", "--out", "t.npz")
    assert tree.code == 2
    assert "a clip needs the neck, the left arm and the right arm" in tree.err
    assert "--fill" in tree.err
    assert run("fit", "tree", "--mocap", "walks", "--fill", "--out", "t.npz").code == 0
    assert motionenv.load(tmp_path / "t.npz").card_["command"].endswith("--mocap walks --fill --out t.npz")
