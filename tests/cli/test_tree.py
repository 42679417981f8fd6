"""The commands about trees and benchmarks, as people type them."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest

import motionenv
from motionenv.models import Target

CLIPS = [
    "dataset-1_walk_normal_001.bvh", "dataset-1_walk_active_001.bvh", "dataset-1_run_normal_001.bvh",
]  # fmt: skip


def refused(result, says: str) -> None:
    """Exit code 2 and one line on stderr that holds `says`."""
    assert (result.code, result.err.count("\n")) == (2, 1)
    assert result.err.startswith("motionenv: ")
    assert says in result.err


@pytest.fixture
def clips(mocap, tmp_path) -> Path:
    """A folder with three clips of capture and a file that is none."""
    (tmp_path / "clips").mkdir()
    for name in CLIPS:
        shutil.copy(next((mocap / "bandai_namco").rglob(name)), tmp_path / "clips")
    (tmp_path / "clips" / "broken.bvh").write_text("HIERARCHY\n")
    return tmp_path / "clips"


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


def test_fit_tree_mirrored_and_with_an_activity(run, clips, tmp_path):
    options = ["--mirrored", "--activity", "gait", "--fps", 30]
    assert run("fit", "tree", "--mocap", "clips", "--out", "mine.npz", *options).code == 0
    tree = motionenv.load(tmp_path / "mine.npz")
    assert tree.database_.mirrored.sum() == 3
    assert set(tree.database_.activities) == {"gait"}
    assert tree.card_["command"].endswith("clips --fps 30 --activity gait --mirrored --out mine.npz")


def test_fit_tree_without_capture_leaves_nothing(run, tmp_path):
    refused(run("fit", "tree", "--mocap", ".", "--out", "m.npz"), "no AMC, BVH, C3D, NPZ or TRC")
    refused(run("fit", "tree", "--mocap", ".", "--out", "nowhere/m.npz"), "nowhere")
    refused(run("fit", "walk/fpca", "--mocap", ".", "--out", "m.npz", "--mirrored"), "only for tree")
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n")
    result = run("fit", "tree", "--mocap", ".", "--out", "m.npz")
    assert result.code == 2
    assert "none of 1 files can be used; the first, broken.bvh" in " ".join(result.err.split())
    assert [p.name for p in tmp_path.iterdir()] == ["broken.bvh"]


@pytest.mark.parametrize("suffix", ["bvh", "c3d", "csv", "glb", "npz"])
def test_sample_writes_every_format(run, tmp_path, suffix):
    result = run("sample", "--start", "walk", "--seconds", 1, "--temperature", 0.5, "--out", f"w.{suffix}")
    assert result.out == f"w.{suffix}  30 frames, 1 s at 30 fps\n"
    assert (tmp_path / f"w.{suffix}").stat().st_size > 1000


def test_sample_films(run, tmp_path):
    result = run("sample", "--seconds", 0.4, "--size", "64x48", "--view", "front", "--out", "w.mp4")
    assert (result.code, result.out) == (0, "w.mp4  12 frames, 0.4 s at 30 fps\n")
    with av.open(tmp_path / "w.mp4") as video:
        assert len(list(video.decode(video=0))) == 12


def test_sample_is_the_motion_that_python_gives(run, tmp_path):
    options = {"--start": "brisk walk", "--seconds": 2, "--temperature": 0.3, "--seed": 5, "--method": "tree"}
    steering = {"--activity": "turn left", "--heading": 90, "--speed": 1.1}
    given = [word for pair in {**options, **steering}.items() for word in pair]
    run("sample", *given, "--no-blend", "--no-contact", "--out", "w.npz")
    expected = motionenv.load("mixed/tree").generator(
        "brisk walk", temperature=0.3, seed=5, method="tree", blend=0.0, contact=False,
        target=Target("turn left", math.pi / 2, 1.1),
    ).motion(2)  # fmt: skip
    assert motionenv.read(tmp_path / "w.npz").poses.tobytes() == expected.poses.tobytes()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--tree mixed/nothing --out w.npz", "mixed/tree"),
        ("--tree missing.npz --out w.npz", "missing.npz"),
        ("--tree walk/fpca --out w.npz", "motionenv synth walk/fpca"),
        ("--start swim --out w.npz", "slow walk"),
        ("--activity swim --out w.npz", "slow walk"),
        ("--heading nan --out w.npz", "heading"),
        ("--speed -1 --out w.npz", "speed"),
        ("--temperature 0 --out w.npz", "temperature"),
        ("--method best --out w.npz", "method"),
        ("--seconds nan --out w.npz", "seconds"),
        ("--out w.xyz", ".xyz"),
        ("--out nowhere/w.npz", "nowhere"),
        ("--view above --out w.mp4", "side, front, oblique"),
        ("--size 8x8 --out w.mp4", "WIDTHxHEIGHT"),
    ],
)
def test_bad_input_is_told_in_one_line_and_leaves_nothing(run, tmp_path, options, says):
    refused(run("sample", *options.split()), says)
    assert list(tmp_path.iterdir()) == []


def test_bench_lists_runs_and_refuses(run, tmp_path):
    listed = run("bench")
    assert listed.code == 0
    assert {"cycles", "startup", "lifting", "lifting.raw", "render"} <= set(listed.out.split())
    refused(run("bench", "speed"), "startup")
    environment = {**os.environ, "PYTHONPATH": str(Path(motionenv.__file__).parents[1])}
    command = [sys.executable, "-m", "motionenv", "bench"]
    options = {"capture_output": True, "text": True, "env": environment, "cwd": tmp_path}
    done = subprocess.run([*command, "startup", "--imports"], **options)
    assert (done.returncode, done.stderr) == (0, "")
    assert "| `import motionenv` |" in done.stdout
    explained = subprocess.run([*command, "models.synthesis", "--", "--help"], **options)
    assert explained.returncode == 0
    assert "--walks" in explained.stdout
    assert subprocess.run([*command, "models.synthesis", "--no-such-option"], **options).returncode == 2


def test_bench_outside_a_checkout_says_where_benchmarks_are(tmp_path):
    package = Path(motionenv.__file__).parent
    shutil.copytree(package, tmp_path / "motionenv", ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [sys.executable, "-m", "motionenv", "bench", "render"], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 2
    assert "clone the repository" in done.stderr
