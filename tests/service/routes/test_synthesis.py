"""`POST /v1/synthesis`: every format read back, the same bytes each time, and limits before work."""

import io
import json
import re

import bvh
import ezc3d
import numpy as np
import pygltflib
import pytest
from PIL import Image, ImageSequence

import motionenv
from motionenv.body import markers
from tests.service.waiting import until

ASK = {"seed": 3, "seconds": 1.0, "fps": 30, "deviations": [1.0, -0.5], "speed": 1.2, "height": 1.6, "phase": 0.25}
SMALL = {"width": 64, "height": 48}
FILES = {"application/x-npz": ".npz", "text/csv": ".csv", "model/x-bvh": ".bvh", "model/gltf-binary": ".glb",
         "application/x-c3d": ".c3d", "text/x-trc": ".trc", "text/x-mot": ".mot"}  # fmt: skip


def expected() -> motionenv.Motion:
    asked = {key: value for key, value in ASK.items() if key not in ("seconds", "fps")}
    return motionenv.synthesize("walk/fpca", 1.0, 30, **asked)


def post(server, accept="application/json", **changed):
    return server.http.post("/v1/synthesis", json=ASK | changed, headers={"Accept": accept})


def test_json_is_the_motion_that_python_makes(server):
    told = post(server).json()
    motion = expected()
    np.testing.assert_array_equal(told["poses"], motion.poses)
    np.testing.assert_array_equal(told["offsets"], motion.skeleton.offsets)
    np.testing.assert_array_equal(told["radii"], motion.skeleton.radii)
    assert (told["model"], told["seed"], told["fps"], told["height"]) == ("walk/fpca", 3, 30.0, 1.6)
    assert tuple(told["pose"]) == motionenv.types.POSE


def test_raw_poses_are_read_by_numpy(server):
    np.testing.assert_array_equal(np.load(io.BytesIO(post(server, "application/x-npy").content)), expected().poses)


def test_walks_along_a_path_are_those_that_python_makes(server):
    path, speeds = [[0, 0], [2, 0.5], [3, 2]], [[0.0, 0.0], [0.5, 1.3]]
    made = post(server, seconds=3, path=path, speeds=speeds, speed=None)
    asked = ASK | {"seconds": 3, "path": path, "speed": speeds}
    motion = motionenv.synthesize("walk/fpca", asked.pop("seconds"), asked.pop("fps"), **asked)
    np.testing.assert_array_equal(made.json()["poses"], motion.poses)
    assert motion.poses[-1, 5] > 0.3  # it turned left


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"path": [[0, 0], [0, 0]]}, "no two in a row are equal"),
        ({"path": [[0, 0], [1, 0], [0, 0.1]]}, "people need 0.6 m to walk"),
        ({"path": [[x * 1e4, 0] for x in (1, -1, 1, -1)]}, "the way through the points must be"),
        ({"speeds": [[1, 1], [0, 1]], "speed": None}, "increasing times"),
        ({"speeds": [[0, 50]], "speed": None}, "speed must be a number .* to 3"),
        ({"speeds": [[0, 1]]}, "either speed or speeds"),
    ],
)
def test_paths_and_speeds_that_nobody_walks_are_refused_in_words(server, wrong, says):
    answer = post(server, **wrong)
    assert answer.status_code == 422
    assert re.search(says, answer.text)


def test_speeds_beyond_what_was_learned_are_told(server):
    high = motionenv.load("walk/fpca").learned_speeds()[1]
    assert "motion-warning" not in post(server, speed=high).headers
    for asked in ({"speed": 2.5}, {"speed": None, "speeds": [[0, 0], [1, 2.5]]}):
        assert post(server, **asked).headers["motion-warning"].startswith("speed 2.5 m/s is beyond the walks")


@pytest.mark.parametrize("media_type", FILES)
def test_files_are_those_that_python_writes(server, media_type, tmp_path):
    answer = post(server, media_type)
    assert answer.headers["content-type"].startswith(media_type)
    got, wanted = (tmp_path / f"{name}{FILES[media_type]}" for name in ("got", "wanted"))
    got.write_bytes(answer.content)
    motionenv.write(expected(), wanted)
    if media_type == "application/x-npz":
        assert motionenv.read(got).poses.tobytes() == motionenv.read(wanted).poses.tobytes()
    else:
        assert got.read_bytes() == wanted.read_bytes()


def test_files_are_read_by_other_readers(server, tmp_path):
    tree = bvh.Bvh(post(server, "model/x-bvh").text)
    assert (tree.nframes, round(1 / tree.frame_time)) == (30, 30)
    assert len(pygltflib.GLTF2.load_from_bytes(post(server, "model/gltf-binary").content).animations) == 1
    table = np.genfromtxt(io.StringIO(post(server, "text/csv").text), delimiter=",", names=True)
    np.testing.assert_array_equal(table["root_x_m"], expected().poses[:, 0])
    (tmp_path / "a.c3d").write_bytes(post(server, "application/x-c3d").content)
    points = ezc3d.c3d(str(tmp_path / "a.c3d"))["data"]["points"][:3].transpose(2, 1, 0) / 1000
    np.testing.assert_allclose(points, markers(expected().poses, expected().skeleton), atol=1e-6)


@pytest.mark.parametrize("media_type", ["image/gif", "image/webp"])
def test_animations_are_read_by_pillow(server, media_type):
    image = Image.open(io.BytesIO(post(server, media_type, seconds=0.5, picture=SMALL).content))
    assert image.size == (64, 48)
    frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(image)]
    assert len(frames) == 15
    assert any((frame != frames[0]).any() for frame in frames)


def test_a_picture_is_the_frame_asked_for_in_the_colours_asked_for(server):
    how = {**SMALL, "frame": 7, "view": 0, "elevation": 10, "follow": False, "background": [1, 0, 0]}
    image = np.asarray(Image.open(io.BytesIO(post(server, "image/png", picture=how).content)))
    frames = list(motionenv.film(
        expected(), 0.0, width=64, height=48, elevation=np.radians(10), follow=False, background=(1, 0, 0)
    ))  # fmt: skip
    np.testing.assert_array_equal(image, frames[7])
    dots = {**SMALL, "style": "points", "colour": [0, 1, 0]}
    seen = np.asarray(Image.open(io.BytesIO(post(server, "image/png", picture=dots).content)))
    assert seen[..., 1].max() > 100
    assert seen[..., [0, 2]].max() == 0


@pytest.mark.parametrize("model", ["walk/eigenwalkers", "walk/prior"])
def test_other_walkers_walk(server, model):
    told = post(server, model=model, deviations=None, scores=[0.1, 0.2]).json()
    asked = {k: v for k, v in ASK.items() if k not in ("seconds", "fps", "deviations")}
    motion = motionenv.synthesize(model, 1.0, 30, scores=[0.1, 0.2], **asked)
    np.testing.assert_array_equal(told["poses"], motion.poses)


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers", "walk/prior"])
def test_defaults_are_right_for_any_walker(server, model):
    for route in ("synthesis", "cycles", "gait"):
        assert server.http.post(f"/v1/{route}", json={"model": model}).status_code == 200


def test_a_tree_moves_too_and_refuses_what_it_has_not(server):
    answers = []

    def answered() -> bool:
        """Ask; while the tree is being built, the answer is to ask again later."""
        answers.append(server.http.post("/v1/synthesis", json={"model": "mixed/tree", "seed": 1}))
        return answers[-1].status_code != 503

    until(answered, seconds=180)
    assert all(int(answer.headers["retry-after"]) >= 1 for answer in answers[:-1])
    assert len(answers[-1].json()["poses"]) == 120
    wrong = post(server, model="mixed/tree", phase=0.0)
    assert wrong.status_code == 422
    assert "no components" in wrong.json()["detail"]


@pytest.mark.parametrize(
    ("accept", "got"),
    [
        (None, "application/json"),
        ("*/*", "application/json"),
        ("application/x-npy", "application/x-npy"),
        ("text/csv;q=0.5, application/x-npz;q=0.9", "application/x-npz"),
        ("application/*", "application/json"),
        ("image/*;q=0.1, text/csv;q=0.2", "text/csv"),
        ("text/html, */*;q=0.8", "application/json"),
        ("text/html", None),
        ("application/json;q=0", None),
        ("nonsense", None),
    ],
)
def test_formats_are_negotiated(server, accept, got):
    headers = {} if accept is None else {"Accept": accept}
    answer = server.http.post("/v1/synthesis", json={"seed": 1, "seconds": 0.2}, headers=headers)
    if got is None:
        assert answer.status_code == 406
        assert "application/json" in answer.json()["detail"]
    else:
        assert answer.headers["content-type"].split(";")[0] == got


def test_who_walks_is_said_once_and_within_the_model(server):
    both = post(server, scores=[1.0])
    assert both.status_code == 422
    assert "not both" in both.json()["detail"]
    many = post(server, deviations=[0.0] * 9)
    assert many.status_code == 422
    assert "8" in many.json()["detail"]
    (error,) = post(server, deviations=[9.0]).json()["errors"]
    assert (error["field"], error["bound"]) == ("/deviations/0", {"le": 5.0})


def got(server, headers=(), **query):
    """`GET /v1/synthesis`: what isn't text is JSON."""
    text = {name: value if isinstance(value, str) else json.dumps(value) for name, value in query.items()}
    return server.http.get("/v1/synthesis", params=text, headers={"Accept-Encoding": "identity", **dict(headers)})


@pytest.mark.parametrize("media_type", ["application/json", "text/csv", "image/png", "image/gif"])
def test_an_address_is_that_of_the_motion_that_is_posted(server, media_type):
    asked = ASK | {"person": "woman", "deviations": None, "speed": None, "speeds": [[0, 0], [1, 1.2]],
                   "path": [[0, 0], [2, 0.5]], "picture": SMALL}  # fmt: skip
    answer = got(server, format=media_type, **asked)
    posted = server.http.post("/v1/synthesis", json=asked, headers={"Accept": media_type})
    assert (answer.status_code, answer.content) == (200, posted.content)
    assert answer.content == got(server, {"Accept": media_type}, **asked).content
    assert answer.headers["cache-control"] == "private, max-age=86400"
    for given in (answer.headers["etag"], "*"):
        again = got(server, {"If-None-Match": given}, format=media_type, **asked)
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", answer.headers["etag"])
    assert got(server, format=media_type, **asked | {"seed": 4}).headers["etag"] != answer.headers["etag"]


def test_a_walk_that_is_drawn_anew_is_not_kept(server):
    one, other = got(server, seconds=0.5), got(server, {"If-None-Match": "*"}, seconds=0.5)
    assert one.content != other.content
    assert one.headers["cache-control"] == "no-store"


def test_an_address_that_is_none_says_which_parameter(server):
    for query, field in (({"fps": 999}, "fps"), ({"person": 3}, "person"), ({"speeds": [[1, 1], [0, 1]]}, "speeds"),
                         ({"picture": {"width": 1}}, "picture.width"), ({"sped": 1}, "sped")):  # fmt: skip
        answer = got(server, **query)
        assert (answer.status_code, [e["field"] for e in answer.json()["errors"]]) == (422, [field])


@pytest.mark.parametrize("media_type", ["video/mp4", "image/webp"])
def test_parts_of_a_film_are_those_of_the_whole(server, media_type):
    asked = {"seed": 3, "seconds": 0.5, "picture": SMALL, "format": media_type}
    whole = got(server, **asked)
    for text, expected in (("bytes=0-1", slice(0, 2)), ("bytes=100-", slice(100, None)), ("bytes=-7", slice(-7, None)),
                           ("bytes=9-999999", slice(9, None))):  # fmt: skip
        part = got(server, {"Range": text}, **asked)
        assert (part.status_code, part.content) == (206, whole.content[expected])
        first = range(len(whole.content))[expected].start
        last = first + len(part.content) - 1
        assert part.headers["content-range"] == f"bytes {first}-{last}/{len(whole.content)}"
        assert part.headers["etag"] == whole.headers["etag"]
    for text in ("bytes=0-", "bytes=0-1,3-4", "nonsense"):  # as the RFC allows
        assert got(server, {"Range": text}, **asked).content == whole.content
    beyond = got(server, {"Range": "bytes=9999999-"}, **asked)
    assert (beyond.status_code, beyond.headers["content-range"]) == (416, f"bytes */{len(whole.content)}")
    assert got(server, {"Range": "bytes=0-1", "If-Range": '"other"'}, **asked).content == whole.content
