"""`motionenv synth`, `sample` and `render` as people type them."""

import math

import av
import numpy as np
import pytest
from PIL import Image, ImageSequence

import motionenv
from motionenv.models import Target
from tests.cli.talking import refused


@pytest.mark.parametrize("suffix", ["bvh", "c3d", "csv", "glb", "npz"])
def test_synth_writes_every_format(run, tmp_path, suffix):
    result = run("synth", "walk/fpca", "--seconds", 1, "--fps", 30, "--out", f"w.{suffix}")
    assert result.out == f"w.{suffix}  30 frames, 1 s at 30 fps\n"
    assert (tmp_path / f"w.{suffix}").stat().st_size > 1000


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_synth_is_the_motion_that_python_gives(run, tmp_path, model):
    from motionenv.models.synthesis import synthesize

    asked = {"seed": 7, "speed": 1.3, "height": 1.6, "phase": 0.2, "variation": 0.5}
    run("synth", model, "--seconds", 1, "--fps", 30, *(f"--{k}={v}" for k, v in asked.items()), "--out", "w.npz")
    expected = synthesize(model, 1.0, 30.0, **asked)
    made = motionenv.read(tmp_path / "w.npz")
    assert made.poses.tobytes() == expected.poses.tobytes()
    assert made.skeleton.height == 1.6


def test_synth_takes_who_walks_as_deviations(run, tmp_path):
    from motionenv.models.synthesis import synthesize

    run("synth", "walk/fpca", "--seconds", 1, "--fps", 30, "--deviations", "1,0,-2", "--out", "w.npz")
    expected = synthesize("walk/fpca", 1.0, 30.0, seed=0, deviations=[1.0, 0.0, -2.0])
    assert motionenv.read(tmp_path / "w.npz").poses.tobytes() == expected.poses.tobytes()
    refused(run("synth", "walk/fpca", "--deviations", "1;2", "--out", "w.npz"), "separated by commas")


@pytest.mark.parametrize(
    ("options", "out"),
    [
        (["--view", "front"], "w.mp4"),
        (["--view", "-37.5", "--still"], "w.gif"),
        (["--points", "--view", "oblique"], "w.webp"),
        ([], "frames"),
    ],
)
def test_render_makes_films(run, tmp_path, walk, options, out):
    result = run("render", walk, *options, "--size", "64x48", "--out", out)
    assert result.out == f"{out}  8 frames\n"
    if out == "frames":
        pictures = [np.array(Image.open(p)) for p in sorted((tmp_path / out).iterdir())]
    elif out == "w.mp4":
        with av.open(tmp_path / out) as video:
            pictures = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    else:
        with Image.open(tmp_path / out) as film:
            pictures = [np.array(frame.convert("RGB")) for frame in ImageSequence.Iterator(film)]
    assert len(pictures) == 8
    assert pictures[0].shape == (48, 64, 3)
    assert (pictures[0] != pictures[-1]).any()


@pytest.mark.parametrize("suffix", ["bvh", "c3d", "csv", "glb", "npz"])
def test_sample_writes_every_format(run, tmp_path, suffix):
    result = run("sample", "--start", "walk", "--seconds", 1, "--temperature", 0.5, "--out", f"w.{suffix}")
    assert result.out == f"w.{suffix}  30 frames, 1 s at 30 fps\n"
    assert (tmp_path / f"w.{suffix}").stat().st_size > 1000


@pytest.mark.parametrize("command", ["sample", "synth walk/fpca --fps 30"])
def test_films(run, tmp_path, command):
    result = run(*command.split(), "--seconds", 0.4, "--size", "64x48", "--view", "front", "--out", "w.mp4")
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
        ("--out w.xyz", ".mp4, .gif, .webp, .bvh"),
        ("--out nowhere/w.npz", "nowhere"),
        ("--view above --out w.mp4", "side, front, oblique"),
        ("--size 8x8 --out w.mp4", "WIDTHxHEIGHT"),
    ],
)
def test_a_sample_that_can_not_be_is_told_in_one_line_and_leaves_nothing(run, tmp_path, options, says):
    refused(run("sample", *options.split()), says)
    assert list(tmp_path.iterdir()) == []
