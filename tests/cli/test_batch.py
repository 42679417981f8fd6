import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

import motionenv


@pytest.fixture
def files(tmp_path):
    """Three captures in two folders, and one that is none."""
    for k, name in enumerate(("a/one.bvh", "a/two.bvh", "b/one.bvh")):
        path = tmp_path / "clips" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        motionenv.write(motionenv.synthesize("walk/fpca", 1, 30, seed=k), path)
    (tmp_path / "clips" / "b" / "bad.bvh").write_text("HIERARCHY\nnonsense")
    return tmp_path / "clips"


def batch(folder, *args) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "motionenv", "batch", *map(str, args)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_each_file_gets_its_result_and_a_row(files, tmp_path, workers):
    first = batch(tmp_path, "convert", "clips/**/*.bvh", "--out", "made", "--suffix", ".npz", "--workers", workers)
    assert first.returncode == 3
    assert "b/bad.bvh failed: " in first.stderr
    assert "3 files done, 0 were done before, 1 left" in first.stdout
    for name in ("a/one", "a/two", "b/one"):
        alone = motionenv.retarget(motionenv.read(files / f"{name}.bvh"))
        stored = motionenv.read_motion(tmp_path / "made" / f"{name}.npz")
        np.testing.assert_allclose(stored.poses, alone.poses, atol=1e-9)
        row = json.loads((tmp_path / "made" / "manifest" / f"{name}.bvh.json").read_text())
        assert (row["result"], row["error"]) == (f"{name}.npz", "")
    shutil.copy(files / "a" / "one.bvh", files / "b" / "bad.bvh")
    second = batch(tmp_path, "convert", "clips/**/*.bvh", "--out", "made", "--suffix", ".npz", "--workers", workers)
    assert second.returncode == 0, second.stderr
    assert "1 files done, 3 were done before, 0 left" in second.stdout


def test_other_options_and_no_files_are_refused(run, files, tmp_path):
    assert run("batch", "convert", "clips/a/*.bvh", "--out", "made", "--workers", 1).code == 0
    other = run("batch", "convert", "clips/a/*.bvh", "--out", "made", "--workers", 1, "--fill")
    assert other.code == 2
    assert "has results of `convert`: use the same options, or another --out" in other.err
    assert "no file is like 'clips/*.xyz'" in run("batch", "convert", "clips/*.xyz", "--out", "x").err
    assert "batch takes convert, lift, report, track; got 'fit'" in run("batch", "fit", "*", "--out", "x").err
