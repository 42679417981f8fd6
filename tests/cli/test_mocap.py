"""`motionenv mocap`: downloading, asking what is in files, converting them."""

import hashlib
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace

import numpy as np
import pytest
import typer

import motionenv
from motionenv.mocap import sources
from tests.cli.talking import in_a_process, refused


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


@pytest.mark.parametrize("fps", ["nan", "0", "-1", "inf"])
def test_a_frame_rate_that_is_none_is_refused(run, mocap, fps):
    refused(run("mocap", "info", mocap / "cmu_asfamc" / "02" / "02_01.amc", "--fps", fps), "fps")


def test_lower_bodies_are_converted_as_they_are_or_filled(run, tmp_path):
    walk = motionenv.synthesize("walk/fpca", 1.0, 30.0, seed=1)
    poses = walk.poses.copy()
    poses[:, 6:17] = np.nan
    motionenv.write(motionenv.Motion(poses, walk.skeleton, walk.fps), tmp_path / "lower.npz")
    as_is = run("mocap", "convert", "lower.npz", "--out", "same.npz")
    assert as_is.out == "same.npz  30 frames\n"
    assert as_is.err == "lower.npz doesn't show the neck, the left arm and the right arm: --fill estimates them\n"
    filled = run("mocap", "convert", "lower.npz", "--fill", "--out", "whole.npz")
    assert (filled.out, filled.err) == ("whole.npz  30 frames, 44% of the entries filled by the model\n", "")
    same, whole = (motionenv.read(tmp_path / name).poses for name in ("same.npz", "whole.npz"))
    np.testing.assert_array_equal(same, poses)
    np.testing.assert_array_equal(whole, motionenv.fill(motionenv.read_motion(tmp_path / "lower.npz")).poses)
    for options in ([], ["--fill"]):
        assert run("render", "lower.npz", *options, "--size", "64x48", "--out", "w.gif").out == "w.gif  30 frames\n"
