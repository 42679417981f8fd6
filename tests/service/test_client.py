"""`motionenv.Client` against a running service."""

import http.server
import json
import math
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

import motionenv
from motionenv import MotionError, ServiceError
from motionenv.lifting import project_markers


@pytest.fixture(scope="module")
def client(server):
    with motionenv.Client(server.url, patience=90) as client:
        yield client


def test_models_are_listed_and_described(client):
    assert {"walk/fpca", "walk/eigenwalkers", "mixed/tree"} <= {model["name"] for model in client.models()}
    told, model = client.model("walk/fpca"), motionenv.load("walk/fpca")
    assert [c["deviation"] ** 2 for c in told["components"]] == pytest.approx(model.fpca_.explained_variance_)
    assert told["height"] == model.height_
    assert told["ranges"]["speed"] == {"minimum": 0.1, "maximum": 3.0, "unit": "m/s"}
    assert told["card"]["people"]


def test_a_walker_is_who_is_asked_for(client):
    how = {"deviations": np.array([1.0, -2.0]), "variation": np.float64(0), "seed": np.int64(4), "speed": None}
    motion = client.synthesize("walk/fpca", 2, 50, **how)
    np.testing.assert_array_equal(motion.poses, motionenv.synthesize("walk/fpca", 2, 50, **how).poses)


def test_without_a_seed_walkers_differ(client):
    one, other = (client.synthesize("walk/fpca", 1, 30) for _ in range(2))
    assert (one.poses != other.poses).any()


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".bvh", ".glb", ".c3d", ".json", ".npy", ".mp4", ".webp", ".png"])
def test_files_come_in_every_format(client, tmp_path, suffix):
    path = tmp_path / f"walk{suffix}"
    client.save(path, "walk/fpca", 1, 30, seed=1, picture={"width": 64, "height": 64})
    assert path.stat().st_size > 500
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == client.film(
        "walk/fpca", 1, 30, suffix=suffix, seed=1, picture={"width": 64, "height": 64}
    )


def test_what_cant_be_saved_leaves_an_older_file_alone(client, tmp_path):
    path = tmp_path / "walk.bvh"
    path.write_text("mine")
    with pytest.raises(ServiceError) as refused:
        client.save(path, "walk/fpca", 1, 30, speed=50)
    assert refused.value.status == 422
    assert [(e["field"], e["bound"]) for e in refused.value.errors] == [("/speed", {"le": 3.0})]
    assert refused.value.request_id
    with pytest.raises(MotionError, match="suffix must be one of"):
        client.save(tmp_path / "walk.avi", "walk/fpca", 1, 30)
    assert [p.read_text() for p in tmp_path.iterdir()] == ["mine"]


def test_a_problem_says_what_python_would_say(client):
    with pytest.raises(ServiceError, match="there is no model 'walk/nobody'") as missing:
        client.synthesize("walk/nobody", 1, 30)
    assert missing.value.status == 404


def test_samples_are_those_of_the_tree(client):
    tree = motionenv.load("mixed/tree")
    before = motionenv.synthesize("walk/fpca", 1, 30, seed=3)
    drawn = client.tree_samples(before, 20, seed=7, temperature=0.2, method="exact")
    expected = tree.sample(before.poses, 20, seed=7, temperature=0.2, method="exact", probability=True)
    np.testing.assert_array_equal(drawn.poses, expected.poses)
    np.testing.assert_array_equal(drawn.windows, expected.windows)
    assert type(drawn) is type(expected)
    np.testing.assert_allclose(drawn.log_probability, expected.log_probability, atol=1e-12)
    assert client.tree_samples(tree.database_.activities[0], 3, seed=1).poses.shape == (3, 25)


def test_motion_grows_as_in_python(client):
    grown = client.tree_synthesize(3, "walk", seed=5, temperature=0.1)
    expected = motionenv.load("mixed/tree").generator("walk", seed=5, temperature=0.1).motion(3)
    np.testing.assert_array_equal(grown.poses, expected.poses)


def test_points_are_lifted_as_in_python(client):
    points = project_markers(
        motionenv.load("walk/eigenwalkers").synthesize_markers(3.0, 30, seed=5), math.radians(40.0)
    )
    positions = points.positions.copy()
    positions[::4, 7] = np.nan
    points = motionenv.Points(positions, points.fps, points.unit)
    told, found = client.lift(points), motionenv.lift(points)
    np.testing.assert_allclose(told.markers.positions, found.markers().positions, atol=1e-9)
    assert told.alpha == pytest.approx(found.posterior.alpha, abs=1e-9)
    assert [o.alpha for o in told.others] == pytest.approx([o.alpha for o in found.others], abs=1e-9)
    assert told.swapped.shape == (90, 2)
    assert client.lift(points, math.radians(40), elevation=None).plausible in (True, False)


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    """Walks of three people as files."""
    folder = tmp_path_factory.mktemp("capture")
    for person in range(3):
        motionenv.write(motionenv.synthesize("walk/fpca", 6, 60, seed=person), folder / f"{person}_01.npz")
    return sorted(folder.iterdir())


def test_a_model_is_fitted_and_walks(client, capture):
    seen = []
    job = client.fit("by-client", capture).wait(lambda job: seen.append((job.status, job.progress)), timeout=120)
    assert (job.status, job.kind, job.model) == ("done", "fit", "fitted/by-client")
    assert seen[-1] == ("done", 1.0)
    assert [progress for _, progress in seen] == sorted(progress for _, progress in seen)
    assert sorted(job.result()["used"]) == [path.name for path in capture]
    assert client.synthesize("fitted/by-client", 1, 30, seed=1).poses.shape == (30, 25)
    assert job.id in [other.id for other in client.jobs()]
    client.remove_model("fitted/by-client")
    job.remove()
    with pytest.raises(ServiceError, match="no such job") as gone:
        client.job(job.id)
    assert gone.value.status == 404


def test_jobs_that_fail_say_why(client, tmp_path):
    broken = tmp_path / "broken.bvh"
    broken.write_text("HIERARCHY\nnonsense")
    job = client.convert([broken], ".glb")
    with pytest.raises(ServiceError, match=r"broken\.bvh"):
        job.wait(timeout=60)
    with pytest.raises(MotionError, match="can't read"):
        client.inspect([tmp_path / "nothing.bvh"])


def test_films_are_rendered_at_leisure_and_cancelled(client, tmp_path):
    small = {"width": 32, "height": 32}
    job = client.render("walk/fpca", 1, 30, seed=1, picture=small)
    job.wait(timeout=60).save(tmp_path / "walk.mp4")
    assert (tmp_path / "walk.mp4").read_bytes()[4:8] == b"ftyp"
    long = client.render("walk/fpca", 600, 60, picture={"width": 1280, "height": 720})
    with pytest.raises(MotionError, match="takes longer than"):
        long.wait(timeout=0.2)
    with pytest.raises(ServiceError, match="cancelled"):
        long.cancel().wait(timeout=30)
    assert (long.refresh().status, job.cancel().status) == ("cancelled", "done")


def test_motion_without_end(client):
    with client.stream("walk/fpca", seed=1, fps=120, speed=1.2) as stream:
        assert (stream.fps, stream.height > 1) == (120, True)
        poses = [next(stream) for _ in range(60)]
        stream.change(speed=1.6)
        with pytest.raises(ServiceError, match="settings are wrong") as wrong:
            stream.change(speed=100)
        assert wrong.value.errors[0]["field"] == "/speed"
        poses += [next(stream) for _ in range(60)]
    assert np.abs(np.diff(poses, axis=0)).max() < 0.3


def test_keys_come_from_argument_or_environment(locked, monkeypatch):
    monkeypatch.delenv("MOTIONENV_KEY", raising=False)
    with motionenv.Client(locked.url) as client:
        with pytest.raises(ServiceError, match="key") as refused:
            client.models()
        assert refused.value.status == 401
        with pytest.raises(ServiceError, match="key"):
            client.stream()
    with motionenv.Client(locked.url, locked.key) as client:
        assert client.models()
        assert locked.key not in repr(client) + repr(client._connection)
    monkeypatch.setenv("MOTIONENV_KEY", locked.key)
    with motionenv.Client(locked.url) as client:
        assert client.models()
        with client.stream(seed=1) as stream:
            assert next(stream).shape == (25,)


def test_nobody_there_is_said():
    with motionenv.Client("http://127.0.0.1:9", retries=0) as client:
        with pytest.raises(ServiceError, match="start it with `motionenv serve`") as gone:
            client.models()
        with pytest.raises(ServiceError, match="start it with `motionenv serve`"):
            client.stream()
    assert gone.value.status is None
    with pytest.raises(MotionError, match="must begin with http"):
        motionenv.Client("localhost:8000")


@contextmanager
def answering(*answers):
    """A server that gives one answer after the other, (status, headers, body), and the times when it was asked."""
    left, times = list(answers), []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            times.append(time.monotonic())
            status, headers, body = left.pop(0)
            self.send_response(status)
            for name, value in ({"Content-Length": len(body)} | headers).items():
                self.send_header(name, str(value))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Handler) as running:
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{running.server_port}", times
        finally:
            running.shutdown()
            thread.join()


NONE = 200, {}, json.dumps({"models": []}).encode()


def test_what_is_busy_is_asked_again_when_it_says():
    busy = 503, {"Retry-After": 1}, b'{"detail": "too many"}'
    with answering(busy, NONE) as (url, times), motionenv.Client(url) as client:
        assert client.models() == []
    assert 0.9 < times[1] - times[0] < 3


def test_patience_has_an_end():
    with answering((429, {"Retry-After": 60}, b'{"detail": "slower"}')) as (url, times):
        with motionenv.Client(url, patience=2) as client, pytest.raises(ServiceError, match="slower") as busy:
            client.models()
    assert (busy.value.status, busy.value.retry_after, len(times)) == (429, 60.0, 1)


def test_a_date_says_when_too():
    date = time.strftime("%a, %d %b %Y %H:%M:%S GMT", time.gmtime(time.time() + 100))
    with answering((503, {"Retry-After": date}, b"<html>")) as (url, _), motionenv.Client(url) as client:
        with pytest.raises(ServiceError, match="503 Service Unavailable from") as busy:
            client.models()
    assert 95 < busy.value.retry_after <= 100


def test_a_broken_answer_leaves_no_file(tmp_path):
    with answering((200, {"Content-Length": 100}, b"half")) as (url, _), motionenv.Client(url) as client:
        with pytest.raises(ServiceError, match="broke"):
            client._connection.save(tmp_path / "half.mp4", "GET", "/")
    assert list(tmp_path.iterdir()) == []


def test_errors_cross_processes_whole():
    import pickle

    error = ServiceError("no", 422, [{"field": "/fps"}], "abc", 2.0)
    other = pickle.loads(pickle.dumps(error))
    assert (str(other), vars(other)) == (str(error), vars(error))
