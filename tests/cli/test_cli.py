"""The command line as people type it: what it makes, what it says, and what it leaves behind when it can't."""

import hashlib
import os
import resource
import shutil
import subprocess
import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np
import pytest
import typer
from PIL import Image, ImageSequence

import motionenv
from motionenv import cli
from motionenv.mocap import sources

PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(motionenv.__file__).parents[1])}
COMMANDS = [
    "demo", "synth", "sample", "render", "lift", "track", "fit", "models", "serve", "bench",
    "mocap list", "mocap download", "mocap info", "mocap convert",
]  # fmt: skip


def in_a_process(*args, **options) -> subprocess.CompletedProcess:
    """`python -m motionenv ARGS` as a program of its own, with the package that these tests import."""
    command = [sys.executable, "-m", "motionenv", *map(str, args)]
    return subprocess.run(command, text=True, timeout=120, check=False, env=ENVIRONMENT, **PIPES | options)


def refused(result, says: str) -> None:
    """Exit code 2 and one line on stderr that holds `says`."""
    assert result.code == 2
    assert result.err.startswith("motionenv: ")
    assert result.err.count("\n") == 1
    assert says in result.err


@pytest.fixture(scope="module")
def walk(tmp_path_factory) -> Path:
    """A short walk in our own format."""
    path = tmp_path_factory.mktemp("walk") / "walk.npz"
    motionenv.write(motionenv.load("walk/fpca").synthesize(0.4, 20, seed=0), path)
    return path


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
        found |= {f"{name} {n}": c for n, c in inner.items()} if inner else {name: command}
    assert sorted(found) == sorted(COMMANDS)
    for command in found.values():
        assert all(parameter.help for parameter in command.params)


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


def test_as_a_program_it_makes_the_same_bytes(run, tmp_path):
    run("synth", "walk/fpca", "--seconds", 1, "--seed", 5, "--out", "here.npz")
    done = in_a_process("synth", "walk/fpca", "--seconds", 1, "--seed", 5, "--out", "there.npz", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "here.npz").read_bytes() == (tmp_path / "there.npz").read_bytes()


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


def test_models_are_listed_with_their_cards(run):
    result = run("models")
    assert result.code == 0
    for name in ("walk/fpca", "walk/eigenwalkers", "walk/prior"):
        assert name in result.out
    assert result.out.count("model licence: MIT") == 4
    assert result.out.count("command: motionenv fit") == 3
    assert "mixed/tree\n    model: mixed/tree\n    people: 48" in result.out


def test_version(run):
    assert run("--version").out == f"motionenv {motionenv.__version__}\n"


@pytest.fixture
def mirror(tmp_path_factory):
    """A local server with two files, the source that lists them, and its base URL."""
    folder = tmp_path_factory.mktemp("mirror")
    content = {"02/02.asf": b":version 1.10\n", "02/02_01.amc": b":DEGREES\n" * 500}
    for name, body in content.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(body)

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *args):
            pass

    files = tuple(
        sources.SourceFile(name, f"http://127.0.0.1:1/{name}", hashlib.sha256(body).hexdigest(), len(body))
        for name, body in content.items()
    )
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=folder)) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        source = sources.Source("two-walks", "Two walks", "http://example.org", "free for all", "thanks", files)
        yield SimpleNamespace(source=source, url=f"http://127.0.0.1:{server.server_port}", content=content)
        server.shutdown()
        thread.join()


def test_download_shows_the_licence_and_asks_first(run, monkeypatch, mirror, tmp_path):
    monkeypatch.setattr(sources, "list_sources", lambda: (mirror.source,))
    assert "free for all" in run("mocap", "list").out
    asked = []
    monkeypatch.setattr(typer, "confirm", lambda text, abort: asked.append(text))
    result = run("mocap", "download", "two-walks", "--to", "got", "--base-url", mirror.url)
    assert result.code == 0
    assert asked == ["Download under this licence?"]
    assert "free for all" in result.out
    assert result.out.endswith("got  2 files\n")
    for name, body in mirror.content.items():
        assert (tmp_path / "got" / name).read_bytes() == body
    asked.clear()
    assert run("mocap", "download", "two-walks", "--to", "got", "--yes", "--base-url", mirror.url).code == 0
    assert asked == []
    refused(run("mocap", "download", "three-walks", "--to", "got"), "two-walks")


def test_download_without_consent_fetches_nothing(tmp_path):
    done = in_a_process("mocap", "download", "cmu-walks", "--to", "got", cwd=tmp_path, input="n\n")
    assert done.returncode == 1
    assert "licence" in done.stdout
    assert list(tmp_path.iterdir()) == []


def test_info_and_convert_real_capture(run, mocap, tmp_path):
    trial = mocap / "cmu_asfamc" / "02" / "02_01.amc"
    result = run("mocap", "info", trial, "--fps", 120)
    assert "02_01.amc: 343 frames, 2.86 s at 120 fps, gaps 0.0%" in result.out
    assert run("mocap", "convert", trial, "--fps", 120, "--out", "walk.npz").out == "walk.npz  343 frames\n"
    assert motionenv.read(tmp_path / "walk.npz").poses.shape == (343, 25)
    assert run("mocap", "info", "walk.npz").out.endswith("the 25-DOF body\n")
    refused(run("mocap", "info", trial), "frame rate")


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


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("synth walk/nothing --out w.npz", "mixed/tree, walk/eigenwalkers, walk/fpca, walk/prior"),
        ("synth missing.npz --out w.npz", "missing.npz"),
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
        ("render WALK --engine povray --size 16x16 --out w.mp4", "raycast, pyrender"),
        ("render WALK --size 16x16 --out w.avi", ".avi"),
        ("render WALK --size 16x16 --out nowhere/w.mp4", "nowhere"),
        ("render missing.npz --out w.mp4", "missing.npz"),
        ("render WALK --fps 30 --out w.mp4", "fps"),
        ("fit walk/other --mocap . --out m.npz", "must be one of tree, walk/fpca, walk/eigenwalkers, walk/prior"),
        ("fit walk/fpca --mocap . --out m.npz", "no AMC, BVH, C3D, NPZ or TRC"),
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


@pytest.mark.parametrize("fps", ["nan", "0", "-1", "inf"])
def test_a_frame_rate_that_is_none_is_refused(run, mocap, fps):
    refused(run("mocap", "info", mocap / "cmu_asfamc" / "02" / "02_01.amc", "--fps", fps), "fps")


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


@pytest.mark.parametrize("options", ["--nothing", "--fps many", "--seed -1", "--seed 1.5", ""])
def test_usage_errors_end_with_2(run, tmp_path, options):
    out = ["--out", "w.npz"] if options else []
    result = run("synth", "walk/fpca", *options.split(), *out)
    assert result.code == 2
    assert "Usage" in result.err
    assert list(tmp_path.iterdir()) == []


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
    assert done.stderr.startswith("motionenv: can't write")
    assert done.stderr.count("\n") == 1
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
