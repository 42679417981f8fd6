"""Fitting from a folder: which files are used, of whom, and that the shipped models are what the command makes."""

import shutil

import numpy as np
import pytest

import motionenv
import motionenv.body
from motionenv.errors import MotionError
from motionenv.models import training
from motionenv.types import MARKERS

TRIALS = ("07_01", "07_02", "38_01", "35_01", "35_02", "16_15", "16_21")


def copied(mocap, folder, trials):
    """`folder` with CMU `trials` and their skeletons."""
    for trial in trials:
        (folder / trial[:2]).mkdir(parents=True, exist_ok=True)
        for name in (f"{trial[:2]}/{trial}.amc", f"{trial[:2]}/{trial[:2]}.asf"):
            shutil.copy(mocap / "cmu_asfamc" / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def walks(mocap, tmp_path_factory) -> training.Walks:
    folder = copied(mocap, tmp_path_factory.mktemp("walks"), (*TRIALS, "29_01"))
    (folder / "07" / "07_99.amc").write_bytes(b"")
    (folder / "notes.txt").write_text("not capture")
    return training.read_walks(folder, fps=120)


def test_walks_are_used_and_the_rest_is_told(walks):
    assert [m.name for m in walks.motions] == sorted((*TRIALS, "29_01"))
    assert len(walks.markers) == len(walks.strides) == len(TRIALS) + 1
    assert set(walks.left_out) == {"07_99.amc"}
    assert "empty" in walks.left_out["07_99.amc"]
    found = {m.name: s.found for m, s in zip(walks.motions, walks.strides, strict=True)}
    assert found == dict.fromkeys(TRIALS, "period") | {"29_01": "events"}


def test_two_numbers_of_one_person_are_one_person(walks):
    assert dict(zip([m.name for m in walks.motions], walks.subjects, strict=True))["38_01"] == "07"
    assert len(set(walks.subjects)) == 4


@pytest.mark.parametrize("name", training.MODELS)
def test_a_fitted_model_walks_and_says_what_it_is(walks, name, tmp_path):
    model = training.fit(name, walks, "the command")
    card = model.card_
    assert (card["model"], card["command"], card["people"], card["trials"]) == (name, "the command", 4, len(TRIALS) + 1)
    assert card["strides"] == sum(len(walk.strides) for walk in walks.strides)
    assert card["frames"] == sum(len(m.poses) for m in walks.motions)
    assert "licence" in " ".join(card)
    model.save(tmp_path / "m.npz")
    assert motionenv.load(tmp_path / "m.npz").card_ == card


def test_a_folder_without_walks_is_refused(mocap, tmp_path):
    with pytest.raises(MotionError, match=r"no capture \(\.amc, \.bvh"):
        training.read_walks(tmp_path)
    with pytest.raises(MotionError, match=r"no capture \(\.amc, \.bvh"):
        training.read_walks(tmp_path / "nowhere")
    seen = []
    standing = motionenv.synthesize("walk/fpca", 1.0, 30.0, seed=1)
    still = np.repeat(standing.poses[:1], 90, axis=0)
    motionenv.write(motionenv.Motion(still, standing.skeleton, 30.0), tmp_path / "she_01.npz")
    with pytest.raises(MotionError, match="none of 1 files is a walk.*no stride.*not straight"):
        training.read_walks(tmp_path, on_file=seen.append)
    assert seen == ["she_01.npz"]


def test_a_unit_and_a_rate_for_all_files_are_only_for_those_that_state_none(tmp_path):
    """The C3D states millimetres and 60 frames per second, the TRC neither a known unit nor a valid rate."""
    motion = motionenv.synthesize("walk/fpca", 6, 60, seed=4, speed=1.2)
    motionenv.write(motion, tmp_path / "Пётр_01.c3d")
    motionenv.write(motion, tmp_path / "Иван_01.npz")
    points = motionenv.body.markers(motion.poses, motion.skeleton)
    lines = ["PathFileType\t4\t(X/Y/Z)\tx", "DataRate\tNumFrames\tNumMarkers\tUnits", f"0\t{len(points)}\t15\t?"]
    lines.append("Frame#\tTime\t" + "\t\t\t".join(MARKERS))
    for t, frame in enumerate(points):
        lines.append("\t".join([str(t + 1), repr(t / 60), *map(repr, frame.ravel().tolist())]))
    (tmp_path / "Zoë_01.trc").write_text("\n".join(lines), encoding="utf-8")
    walks = training.read_walks(tmp_path, fps=60, unit="m")
    assert not walks.left_out
    assert set(walks.subjects) == {"Пётр", "Иван", "Zoë"}
    for found in walks.motions:
        assert found.fps == 60
        np.testing.assert_allclose(found.skeleton.height, motion.skeleton.height, rtol=0.1)


def test_only_known_models_are_fitted(walks):
    with pytest.raises(MotionError, match="walk/eigenwalkers, walk/prior, got 'run/fpca': did you mean walk/fpca"):
        training.fit("run/fpca", walks, "")


@pytest.mark.slow
def test_the_shipped_models_are_what_the_command_makes(mocap):
    """Of CMU's straight walks: the same arrays, but for rounding on another CPU."""
    walks = training.read_walks(mocap / "cmu_asfamc", fps=120).straight()
    for name in training.MODELS:
        arrays, meta = training.fit(name, walks, "").to_arrays()
        shipped, shipped_meta = motionenv.load(name).to_arrays()
        assert set(arrays) == set(shipped)
        for key, value in arrays.items():
            scale = np.abs(shipped[key]).max(initial=1e-9)
            # The shipped pace was learned from strides in place whose feet were lifted 1e-5 m less or more.
            tolerance = 1e-3 if key.startswith("pace_") else 1e-5
            np.testing.assert_allclose(value, shipped[key], rtol=0, atol=tolerance * scale, err_msg=f"{name} {key}")
        assert meta.keys() == shipped_meta.keys()


@pytest.fixture(scope="module")
def lower_bodies(tmp_path_factory):
    """A folder of walks of which the arms and the neck were never seen, of four people."""
    folder = tmp_path_factory.mktemp("lower")
    for seed in range(8):
        walk = motionenv.synthesize("walk/fpca", 5.0, 40.0, seed=seed, speed=0.9 + 0.1 * seed)
        poses = walk.poses.copy()
        poses[:, 6:17] = np.nan
        motionenv.write(motionenv.Motion(poses, walk.skeleton, walk.fps), folder / f"{seed // 2}_{seed % 2}.npz")
    return folder


@pytest.mark.filterwarnings("error")
def test_lower_bodies_give_a_model_of_lower_bodies(lower_bodies):
    walks = training.read_walks(lower_bodies)
    assert len(walks.motions) == 8
    assert np.isnan(walks.markers[0].positions[:, :2]).all()
    model = training.fit("walk/fpca", walks, "the command")
    assert model.card_["not shown by any walk"] == "the neck, the left arm and the right arm"
    assert np.isnan(model.synthesize(1.0, 30.0, seed=1).poses[:, 6:17]).all()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", training.MODELS)
def test_filled_lower_bodies_give_whole_walkers(lower_bodies, name):
    walks = training.read_walks(lower_bodies, fill=True)
    model = training.fit(name, walks, "the command --fill")
    assert model.card_["filled by another model"] == "what 8 of 8 walks don't show"
    assert "not shown by any walk" not in model.card_
    assert np.isfinite(model.synthesize(1.0, 30.0, seed=1).poses).all()
