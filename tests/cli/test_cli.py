"""The command line as people type it: what it makes, what it says, and what it leaves behind when it can't."""

import os
import resource

import numpy as np
import pytest
import typer

import motionenv
from motionenv import cli
from motionenv.models.paths import WalkPath
from tests.cli.talking import in_a_process, refused

COMMANDS = [
    "demo", "synth", "sample", "render", "lift", "track", "evaluate", "fit", "models", "models describe", "serve",
    "bench", "mocap list", "mocap download", "mocap info", "mocap map", "mocap convert", "report", "stimuli",
    "compare", "compile", "dataset presets", "dataset schema", "dataset preview", "dataset make", "dataset verify",
]  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example_and_explains_every_option(run, command):
    result = run(*command.split(), "--help")
    assert result.code == 0
    assert f"Example: motionenv {command}" in " ".join(result.out.split())


def test_every_command_is_tested_and_every_option_has_help():
    group = typer.main.get_command(cli.app)
    found = {}
    for name, command in group.commands.items():
        inner = getattr(command, "commands", None)
        found |= {f"{name} {n}": c for n, c in (inner or {}).items()}
        if not inner or command.invoke_without_command:
            found[name] = command
    assert sorted(found) == sorted(COMMANDS)
    for command in found.values():
        assert all(parameter.help for parameter in command.params)


def test_as_a_program_it_makes_the_same_bytes(run, tmp_path):
    run("synth", "walk/fpca", "--seconds", 1, "--seed", 5, "--out", "here.npz")
    done = in_a_process("synth", "walk/fpca", "--seconds", 1, "--seed", 5, "--out", "there.npz", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "here.npz").read_bytes() == (tmp_path / "there.npz").read_bytes()


def test_version(run):
    assert run("--version").out == f"motionenv {motionenv.__version__}\n"


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("synth walk/nothing --out w.npz", "mixed/tree, walk/eigenwalkers, walk/fpca, walk/prior"),
        ("synth missing.npz --out w.npz", "missing.npz"),
        ("synth walk/fpca --out w.npz --path arc:3", "arc:RADIUS,DEGREES"),
        ("synth walk/fpca --out w.npz --path arc:0.1,90", "radius must be"),
        ("synth walk/fpca --out w.npz --path nowhere.csv", "nowhere.csv"),
        ("synth walk/fpca --out w.npz --speed 1:2:3", "TIME:SPEED"),
        ("synth walk/fpca --out w.xyz", ".xyz"),
        ("synth walk/fpca --out nowhere/w.npz", "nowhere"),
        ("synth walk/fpca --fps nan --out w.npz", "fps"),
        ("synth walk/fpca --fps 0 --out w.npz", "fps"),
        ("synth walk/fpca --fps -1 --out w.npz", "fps"),
        ("synth walk/fpca --seconds inf --out w.npz", "seconds"),
        ("synth walk/fpca --speed 9 --out w.npz", "speed"),
        ("synth walk/fpca --height 170 --out w.npz", "height"),
        ("synth walk/fpca --variation -1 --out w.npz", "variation"),
        ("synth walk/fpca --phase nan --out w.npz", "phase"),
        ("synth walk/eigenwalkers --fps nan --out w.npz", "fps"),
        ("synth walk/eigenwalkers --fps 0 --out w.npz", "fps"),
        ("synth walk/eigenwalkers --seconds -1 --out w.npz", "seconds"),
        ("synth walk/eigenwalkers --speed nan --out w.npz", "speed"),
        ("synth walk/eigenwalkers --height nan --out w.npz", "height"),
        ("synth walk/eigenwalkers --phase inf --out w.npz", "phase"),
        ("render WALK --size 640 --out w.mp4", "WIDTHxHEIGHT"),
        ("render WALK --size 8x8 --out w.mp4", "WIDTHxHEIGHT"),
        ("render WALK --view above --out w.mp4", "side, front, oblique"),
        ("render WALK --view inf --out w.mp4", "side, front, oblique"),
        ("render WALK --size 16x16 --out w.avi", ".avi"),
        ("render WALK --size 16x16 --out nowhere/w.mp4", "nowhere"),
        ("render missing.npz --out w.mp4", "missing.npz"),
        ("render WALK --fps 30 --out w.mp4", "fps"),
        ("fit walk/other --mocap . --out m.npz", "must be one of tree, walk/fpca, walk/eigenwalkers, walk/prior"),
        ("fit walk/fpca --mocap . --out m.npz", "no capture "),
        ("fit walk/fpca --mocap nowhere --out m.npz", "nowhere"),
        ("fit walk/fpca --mocap . --out nowhere/m.npz", "nowhere"),
        ("mocap info missing.amc --fps 120", "missing.amc"),
        ("mocap info missing.docx", ".docx"),
        ("mocap download nothing --to .", "cmu-walks"),
    ],
)
def test_bad_input_is_told_in_one_line_and_leaves_nothing(run, walk, tmp_path, command, says):
    refused(run(*command.replace("WALK", str(walk)).split()), says)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["amc", "bvh", "c3d", "trc", "npz"])
@pytest.mark.parametrize("content", [b"", b"\0\x01\xff" * 999, b"HIERARCHY\nROOT", b"\xff\xfea\0"])
def test_damaged_files_are_told(run, tmp_path, suffix, content):
    path = tmp_path / f"bad.{suffix}"
    path.write_bytes(content)
    options = ["--fps", 120] if suffix == "amc" else []
    for command in (["mocap", "info", path], ["mocap", "convert", path, "--out", "w.npz"]):
        refused(run(*command, *options), f"bad.{suffix}")
    refused(run("render", path, *options, "--out", "w.mp4"), f"bad.{suffix}")
    refused(run("synth", path, "--out", "w.npz"), f"bad.{suffix}")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("options", ["--nothing", "--fps many", "--seed -1", "--seed 1.5", ""])
def test_usage_errors_end_with_2(run, tmp_path, options):
    out = ["--out", "w.npz"] if options else []
    result = run("synth", "walk/fpca", *options.split(), *out)
    assert result.code == 2
    assert "Usage" in result.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    ["demo --out .", "synth walk/fpca --out w.npz", "synth walk/fpca --out w.bvh", "render WALK --out w.mp4"],
)
def test_a_full_disk_leaves_no_half_written_file(walk, tmp_path, command):
    """Files of this process may hold 4 KiB, so that writes fail as on a full disk."""

    def full():
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    command = command.replace("WALK", str(walk)).split()
    done = in_a_process(*command, cwd=tmp_path, preexec_fn=full)
    assert done.returncode == 2
    *kernels, told = done.stderr.splitlines()
    assert told.startswith("motionenv: can't write")
    assert all("compile" in line or "compiling" in line for line in kernels)  # if their cache was empty
    assert list(tmp_path.iterdir()) == []


def test_a_closed_pipe_and_ctrl_c_end_without_a_traceback(run, monkeypatch):
    reading, writing = os.pipe()
    os.close(reading)
    done = in_a_process("models", stdout=writing)
    os.close(writing)
    assert "Traceback" not in done.stderr
    assert done.returncode != 0

    def interrupt():
        raise KeyboardInterrupt

    monkeypatch.setattr("motionenv.models.names", interrupt)
    result = run("models")
    assert result.code in (1, 130)
    assert "Traceback" not in result.err


def test_a_path_and_speeds_are_those_of_the_library(run, tmp_path):
    (tmp_path / "way.csv").write_text("0,0\n2,0\n4,1\n")
    points, rows = [(0, 0), (2, 0), (4, 1)], [(0, 0), (1, 1.2)]
    expected = motionenv.synthesize("walk/fpca", 3, 30, seed=1, path=points, speed=rows)
    for i, path in enumerate(("0,0 2,0 4,1", "way.csv")):
        run(
            "synth",
            "walk/fpca",
            "--seconds",
            3,
            "--seed",
            1,
            "--path",
            path,
            "--speed",
            "0:0 1:1.2",
            "--out",
            f"{i}.npz",
        )
        np.testing.assert_array_equal(motionenv.read(tmp_path / f"{i}.npz").poses, expected.poses)
    run("synth", "walk/fpca", "--seconds", 2, "--seed", 1, "--path", "arc:3,-90", "--out", "arc.npz")
    expected = motionenv.synthesize("walk/fpca", 2, 30, seed=1, path=WalkPath.arc(3, -np.pi / 2))
    np.testing.assert_array_equal(motionenv.read(tmp_path / "arc.npz").poses, expected.poses)
