"""`motionenv demo`: what it makes opens, and is the same again."""

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

import motionenv
from tests.cli.talking import refused


@pytest.mark.parametrize("folder", ["new/folder", "."])
def test_demo_makes_files_that_open_and_the_same_again(run, monkeypatch, tmp_path, folder):
    monkeypatch.setattr("motionenv.cli.demo.SECONDS", 1)
    files = ("walk.mp4", "strip.png", "walk.bvh")
    made = []
    for _ in range(2):
        result = run("demo", "--seed", 3, "--out", folder)
        assert result.code == 0
        assert [Path(line.split()[0]) for line in result.out.splitlines()] == [Path(folder) / f for f in files]
        made.append({p.name: p.read_bytes() for p in (tmp_path / folder).iterdir()})
    assert made[0] == made[1]
    assert set(made[0]) == set(files)
    with av.open(tmp_path / folder / "walk.mp4") as video:
        assert video.streams.video[0].average_rate == 30
        pictures = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    assert len(pictures) == 30
    body, dots = pictures[0][:, :480], pictures[0][:, -480:]
    assert np.ptp(body) > 100
    assert np.median(dots) < 60
    with Image.open(tmp_path / folder / "strip.png") as strip:
        strip.load()
        assert strip.width > 1500
    capture = motionenv.read(tmp_path / folder / "walk.bvh")
    assert capture.fps == pytest.approx(30, rel=1e-4)
    assert len(capture.positions) == 30


def test_demo_into_a_file_is_refused(run, tmp_path):
    (tmp_path / "taken").write_text("mine")
    refused(run("demo", "--out", "taken"), "--out")
    assert (tmp_path / "taken").read_text() == "mine"
