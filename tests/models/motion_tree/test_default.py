"""The tree that ships: what it is made of, where it is kept, and that everybody makes the same."""

import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import motionenv
from motionenv import models
from motionenv.body import feet
from motionenv.errors import MotionError
from motionenv.models.motion_tree import Target
from motionenv.models.motion_tree import default as mixed
from motionenv.types import Motion

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(motionenv.__file__).parents[1])}


@pytest.fixture(scope="module")
def tree():
    return motionenv.load("mixed/tree")


def test_it_is_a_name_with_a_card_before_it_is_made(monkeypatch, tmp_path):
    monkeypatch.setenv(mixed.CACHE, str(tmp_path))
    assert "mixed/tree" in models.names()
    assert models.card("mixed/tree")["model licence"] == "MIT"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("side", [1, -1])
def test_a_heading_is_reached_from_a_straight_walk(tree, side):
    """Also where no window near the present one turns: the motion comes to one that does; 1 in 30 takes longer."""
    off = []
    for seed in range(8):
        growth = tree.generator("walk", seed=seed, target=Target(heading=0.0))
        growth.step(300)
        growth.target = Target(heading=side * np.pi / 2)
        off.append(np.median(growth.step(600)[-150:, 5]) - side * np.pi / 2)
    assert np.sort(np.abs(off))[-2] < 0.6
    assert np.median(np.abs(off)) < 0.25


def test_it_holds_what_its_card_says(tree):
    card, database = tree.card_, tree.database_
    assert card == models.card("mixed/tree") == mixed.card()
    assert card["frames"] == len(database.poses)
    assert card["windows"] == len(database.windows) == len(tree.frames_)
    assert card["clips"] == len(set(database.clips))
    assert card["people"] == len(set(database.persons))
    assert 45_000 < card["frames"] < 55_000
    assert database.skeleton.height == 1.75
    assert set(database.activities) == {"slow walk", "walk", "brisk walk", "turn left", "turn right"}


def test_clips_do_what_their_tags_say(tree):
    database = tree.database_
    for i, activity in enumerate(database.activities):
        poses = database.motion(i).poses
        turned = poses[-30:, 5].mean() - poses[:30, 5].mean()
        speed = np.linalg.norm(poses[-1, :2] - poses[0, :2]) / (len(poses) - 1) * 30
        if activity.startswith("turn"):
            assert turned * (1 if activity == "turn left" else -1) > 0.4
        else:
            assert abs(turned) < 0.3
            bounds = {"slow walk": (0.65, 1.05), "walk": (0.95, 1.55), "brisk walk": (1.45, 2.15)}[activity]
            assert bounds[0] < speed < bounds[1]


def test_an_arc_keeps_steps_and_lies_on_its_circle(tree):
    """A point that moves along x at an even pace goes round a circle of radius 1/κ; steps are as long as before."""
    poses = np.zeros((200, 25))
    poses[:, 0] = np.arange(200) * 0.04
    arc = mixed.bent(Motion(poses, tree.database_.skeleton, 30.0), 0.2).poses
    centre = [0.0, 5.0]
    np.testing.assert_allclose(np.linalg.norm(arc[:, :2] - centre, axis=1), 5.0, rtol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(np.diff(arc[:, :2], axis=0), axis=1), 0.04, rtol=1e-12)
    np.testing.assert_allclose(arc[:, 5], 0.2 * poses[:, 0])


def test_feet_that_stand_in_curves_hardly_slide(tree):
    database, drifts = tree.database_, []
    for i in np.flatnonzero([a.startswith("turn") for a in database.activities])[::4]:
        motion = database.motion(i)
        ball = feet(motion.poses, motion.skeleton)[1]
        for foot in range(2):
            speed = np.linalg.norm(np.gradient(ball[:, foot, :2], axis=0), axis=1) * 30
            stands = (speed < 0.35) & (ball[:, foot, 2] < ball[:, foot, 2].min() + 0.03)
            edges = np.flatnonzero(np.diff(np.concatenate([[0], stands, [0]])))
            drifts += [
                np.linalg.norm(np.ptp(ball[a:b, foot, :2], axis=0))
                for a, b in zip(edges[::2], edges[1::2], strict=True)
                if b - a >= 6
            ]
    assert len(drifts) > 200
    assert np.median(drifts) < 0.02
    assert np.percentile(drifts, 95) < 0.035


def test_another_process_makes_the_same_bytes_and_the_next_one_reads_them(tree, tmp_path):
    program = "from motionenv.models.motion_tree import default as mixed; print(mixed.path())"
    environment = {**ENVIRONMENT, mixed.CACHE: str(tmp_path / "deep" / "cache")}
    paths = []
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment)
        assert (done.returncode, done.stderr) == (0, "")
        made = Path(done.stdout.strip())
        paths.append((made, made.stat().st_mtime_ns, made.stat().st_ino))
    assert paths[0] == paths[1]
    assert [made] == list((tmp_path / "deep" / "cache").iterdir())
    assert made.read_bytes() == mixed.path().read_bytes()


def test_another_version_or_recipe_reads_another_file(tree, monkeypatch, tmp_path):
    name = mixed.path().name
    assert name == f"mixed-tree-{motionenv.__version__}-{mixed._recipe()}.npz"
    (tmp_path / "assets").mkdir()
    monkeypatch.setattr(mixed, "__file__", str(tmp_path / "motion_tree" / "default.py"))
    assert mixed._recipe() not in name


@pytest.mark.parametrize("folder", ["taken", "taken/below"])
def test_a_cache_that_cant_be_written_names_the_variable(monkeypatch, tmp_path, folder):
    (tmp_path / "taken").write_text("mine")
    monkeypatch.setenv(mixed.CACHE, str(tmp_path / folder))
    with pytest.raises(MotionError, match=r"can't keep mixed/tree in .*taken.*MOTIONENV_CACHE"):
        motionenv.load("mixed/tree")
    assert (tmp_path / "taken").read_text() == "mine"


def sampled(tree) -> np.ndarray:
    """A few draws after the first window of the database."""
    return tree.sample(tree.database_.poses[:12], 4, seed=1, temperature=0.2).poses


def test_another_process_draws_the_same(tree):
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        np.testing.assert_array_equal(pool.submit(sampled, tree).result(), sampled(tree))
