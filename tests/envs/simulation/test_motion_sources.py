"""Where motion comes from, and that training and evaluation never share it."""

import shutil

import numpy as np
import pytest

from motionenv.envs import WalkerTracking
from motionenv.envs.simulation.motion_sources import WALKERS, Source, is_evaluated
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.mocap import write
from motionenv.models.assets import FPCA
from motionenv.models.registry import load
from motionenv.models.synthesis import synthesize
from motionenv.models.walking.model import WalkingModel
from motionenv.models.walking.preprocessing import forward_speed
from motionenv.types import Motion

PEOPLE = ["02", "05", "06", "07", "10", "12", "16", "26"]


def draws(n: int = 40, *, seed: int = 0, frames: int = 31, fps: float = 30.0, split: str = "train", **more) -> list:
    recordings = Source(more.pop("motion", "walk/fpca"), split, frames, fps, **more).open()
    rng = np.random.default_rng(seed)
    return [recordings.draw(rng) for _ in range(n)]


@pytest.fixture
def folder(tmp_path):
    """A walk of each of eight people, who are as tall as their number says, 120 frames at 60 fps."""
    assert {is_evaluated(person) for person in PEOPLE} == {True, False}
    for i, person in enumerate(PEOPLE):
        motion = synthesize("walk/fpca", 2.0, 60.0, seed=i, height=1.5 + 0.05 * i)
        write(motion, tmp_path / f"{person}_01.npz")
    return tmp_path


@pytest.mark.parametrize("motion", ["walk/fpca", "walk/eigenwalkers", "mixed/tree"])
def test_models_give_pieces_of_walks(motion):
    for poses, body in draws(4, motion=motion):
        assert poses.shape == (31, 25)
        assert np.isfinite(poses).all()
        assert 1.5 <= body.height <= 1.95
        assert np.abs(np.diff(poses, axis=0)).max() < 1.0
        assert 0.3 < np.hypot(*(poses[-1, :2] - poses[0, :2])) < 3.5  # goes somewhere in a second
        assert abs(np.sin(poses[:, 5])).mean() < 0.8


@pytest.mark.parametrize("motion", ["walk/fpca", "walk/eigenwalkers"])
def test_speeds_and_heights_are_in_their_ranges(motion):
    found = draws(30, motion=motion, frames=91, speed=(1.0, 1.4), height=(1.2, 1.3))
    speeds = [forward_speed(Motion(poses, body, 30.0)) for poses, body in found]
    assert all(1.2 <= body.height <= 1.3 for _, body in found)
    # A piece isn't a whole number of strides, and a walker's cycles differ: within a tenth.
    assert all(0.9 < speed < 1.54 for speed in speeds)
    assert np.ptp(speeds) > 0.15


def test_splits_of_a_model_share_no_walker():
    def walkers(split):
        recordings = Source("walk/fpca", split, 31, 30.0).open()
        recordings.draw(np.random.default_rng(0))
        every = [recordings._make(block) for block in range(WALKERS // recordings._model.batch_size)]
        return {motion.skeleton.radii.tobytes() for block in every for motion in block}

    train, evaluation = walkers("train"), walkers("eval")
    assert len(train) == len(evaluation) == WALKERS
    assert not train & evaluation


def test_what_is_drawn_depends_on_the_generator_alone():
    first = draws(3, seed=4)
    draws(50, seed=5)
    from motionenv.envs.simulation import motion_sources as sources

    sources._opened.cache_clear()
    again = draws(3, seed=4)
    for (a, p), (b, q) in zip(first, again, strict=True):
        np.testing.assert_array_equal(a, b)
        assert p.height == q.height


def test_people_of_a_folder_are_on_one_side_only(folder):
    sides = {}
    for split in ("train", "eval"):
        found = draws(60, motion=folder, split=split)
        sides[split] = {round(body.height, 6) for _, body in found}
        expected = {1.5 + 0.05 * i for i, p in enumerate(PEOPLE) if is_evaluated(p) == (split == "eval")}
        assert sides[split] == {round(h, 6) for h in expected}
    assert not sides["train"] & sides["eval"]


def test_captured_motion_is_resampled_turned_ahead_and_scaled(tmp_path):
    walk = synthesize("walk/fpca", 3.0, 60.0, seed=1)
    poses = walk.poses.copy()
    poses[:, :2] = poses[:, :2] @ np.array([[0.0, 1.0], [-1.0, 0.0]])  # to the left
    poses[:, 5] += np.pi / 2
    write(Motion(poses, walk.skeleton, 60.0), tmp_path / "walk.npz")
    ((piece, body),) = draws(1, motion=tmp_path / "walk.npz", height=(0.9, 0.9), frames=60)
    assert body.height == pytest.approx(0.9)
    assert forward_speed(Motion(piece, body, 30.0)) == pytest.approx(
        forward_speed(walk) * 0.9 / walk.skeleton.height, rel=0.1
    )
    assert abs(piece[:, 5].mean()) < 0.1
    ((own, tall),) = draws(1, motion=tmp_path / "walk.npz", frames=60)
    np.testing.assert_allclose(own[:, 6:], piece[:, 6:])
    assert tall.height == walk.skeleton.height


def test_real_capture(mocap, tmp_path):
    person = sorted((mocap / "cmu_asfamc" / "02").glob("*.amc"))[0]
    env = WalkerTracking(motion=str(person), file_fps=120.0, horizon=20, size=36, actions="metric")
    env.reset(seed=0)
    assert env.step(env.truth()["pose"])[1] > -1e-6


def test_models_of_ones_own(tmp_path):
    shutil.copy(FPCA.path, tmp_path / "mine.npz")
    (mine, _), (shipped, _) = draws(1, motion=tmp_path / "mine.npz")[0], draws(1)[0]
    np.testing.assert_array_equal(mine, shipped)


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"motion": "walk/nobody"}, "motion must be a model"), ({"motion": "no/such/folder"}, "motion must be a model"),
        ({"split": "test"}, "split must be one of train, eval"), ({"fps": 0}, "fps"), ({"fps": np.nan}, "fps"),
        ({"fps": 1e9}, "fps must be a number of frames per second from 1 to 1000"),
        ({"fps": 1.0, "horizon": 5000}, "horizon must be at most"), ({"file_fps": -120}, "file_fps"),
        ({"file_fps": "many"}, "file_fps"), ({"unit": "parsec"}, "unit"), ({"horizon": 0}, "horizon"),
        ({"horizon": 2.5}, "horizon"), ({"speed": (2.0, 1.0)}, "speed"), ({"speed": 1.0}, "speed"),
        ({"speed": (0.0, 9.0)}, "speed"), ({"height": (0.1, 1.0)}, "height"), ({"height": "tall"}, "height"),
    ],
)  # fmt: skip
def test_impossible_motion_is_named_when_the_environment_is_made(arguments, why):
    with pytest.raises(MotionError, match=why):
        WalkerTracking(**arguments)


def test_a_rate_that_files_dont_say_is_asked_for_by_the_arguments_name(tmp_path):
    (tmp_path / "01_01.amc").touch()
    for motion in (tmp_path, tmp_path / "01_01.amc"):
        with pytest.raises(MotionError, match="file_fps is required"):
            WalkerTracking(motion=motion)


def test_motion_that_is_too_short_is_named(folder):
    with pytest.raises(MotionError, match=r"05_01.npz is too short: .* 60 frames at 30 fps, but an episode needs 91"):
        WalkerTracking(motion=str(folder))
    WalkerTracking(motion=str(folder), horizon=59)


def test_a_folder_without_anyone_to_evaluate_says_so(folder):
    for person in PEOPLE:
        if is_evaluated(person):
            (folder / f"{person}_01.npz").unlink()
    with pytest.raises(MotionError, match="split .eval. of .* is empty.*05"):
        WalkerTracking(motion=str(folder), split="eval", horizon=10)


def test_files_that_are_no_motion_are_named(tmp_path):
    (tmp_path / "05_01.bvh").write_text("HIERARCHY\nnonsense")
    with pytest.raises(MotionError, match=r"05_01.bvh in .* can't be used"):
        WalkerTracking(motion=str(tmp_path))
    np.savez(tmp_path / "x.npz", header=np.array("{}"))
    with pytest.raises(ModelError, match="model"):
        WalkerTracking(motion=str(tmp_path / "x.npz"))
    with pytest.raises(MotionError, match="speed needs a model"):
        WalkerTracking(motion=str(tmp_path), speed=(1.0, 1.2))
    (tmp_path / "empty").mkdir()
    with pytest.raises(MotionError, match="no capture "):
        WalkerTracking(motion=str(tmp_path / "empty"))


def test_a_model_that_doesnt_walk_is_refused(tmp_path):
    fpca = load("walk/fpca").fpca_
    fpca.save(tmp_path / "angles.npz")
    with pytest.raises(MotionError, match="which makes no motion"):
        WalkerTracking(motion=str(tmp_path / "angles.npz"))


def test_motion_of_part_of_the_body_is_refused_by_what_it_lacks(tmp_path):
    """Pictures and beliefs are of whole bodies: a file, and a model fitted to such files."""
    walks = [synthesize("walk/fpca", 4.0, 40.0, seed=seed) for seed in range(5)]
    poses = [walk.poses.copy() for walk in walks]
    for some in poses:
        some[:, 6:17] = np.nan
    lower = [Motion(some, walk.skeleton, walk.fps) for some, walk in zip(poses, walks, strict=True)]
    write(lower[0], tmp_path / "lower.npz")
    WalkingModel(2).fit(lower).save(tmp_path / "model.npz")
    for name, more in (("lower.npz", {}), ("model.npz", {}), ("model.npz", {"seed": 1})):
        with pytest.raises(GapError, match=r"an episode of .* needs the neck, the left arm and the right arm.*--fill"):
            Source(f"{tmp_path / name}", "train", 31, 30.0, **more).open().draw(np.random.default_rng(0))
