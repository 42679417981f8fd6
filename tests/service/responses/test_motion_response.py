"""Motions as answers: cached, bounded, in one piece or in parts."""

import io
import json

import numpy as np
import pytest

import motionenv
from tests.service.inside import answers

ASK = {"seed": 3, "seconds": 1.0, "fps": 30, "deviations": [1.0, -0.5], "speed": 1.2, "height": 1.6, "phase": 0.25}


SMALL = {"width": 64, "height": 48}


def post(server, accept="application/json", **changed):
    return server.http.post(
        "/v1/synthesis", json=ASK | changed, headers={"Accept": accept, "Accept-Encoding": "identity"}
    )


def refused(answer, field: str, bound: float | None = None) -> None:
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == field
    assert bound is None or error["bound"] == {"le": bound}


@pytest.mark.parametrize("media_type", ["application/json", "application/x-npz", "text/csv", "video/mp4", "image/gif"])
def test_the_same_request_gives_the_same_bytes_and_need_not_be_made_again(server, media_type):
    answers = [post(server, media_type, seconds=0.4, picture=SMALL) for _ in range(2)]
    assert answers[0].content == answers[1].content
    etag = answers[0].headers["etag"]
    assert etag == answers[1].headers["etag"]
    assert answers[0].headers["cache-control"] == "private, max-age=86400"
    assert answers[0].headers["vary"] == "Accept, Accept-Encoding"
    ask = ASK | {"seconds": 0.4, "picture": SMALL}
    for given in (etag, f'"other", W/{etag}'):
        kept = server.http.post("/v1/synthesis", json=ask, headers={"Accept": media_type, "If-None-Match": given})
        assert (kept.status_code, kept.json()["status"], kept.headers["etag"]) == (412, 412, etag)
    other = server.http.post("/v1/synthesis", json=ask | {"seed": 4}, headers={"Accept": media_type})
    assert other.headers["etag"] != etag


def test_tags_tell_formats_apart(server):
    assert len({post(server, a).headers["etag"] for a in ("application/json", "text/csv", "application/x-npy")}) == 3


def test_without_a_seed_one_is_drawn_and_told(server):
    answers = [server.http.post("/v1/synthesis", json={"seconds": 0.5}) for _ in range(2)]
    assert answers[0].content != answers[1].content
    assert answers[0].headers["cache-control"] == "no-store"
    assert "etag" not in answers[0].headers
    again = server.http.post("/v1/synthesis", json={"seconds": 0.5, "seed": int(answers[0].headers["motion-seed"])})
    assert again.content == answers[0].content


def test_what_is_too_large_is_refused_before_any_work(tmp_path):
    asked = [
        ("application/json", {"seconds": 4.0}), ("video/mp4", {"picture": SMALL}),
        ("image/png", {"picture": {"width": 200, "height": 100}}), ("image/png", {"picture": SMALL}),
    ]  # fmt: skip
    posts = [("POST", "/v1/synthesis", {"json": ASK | what, "headers": {"Accept": kind}}) for kind, what in asked]
    long, film, wide, right = answers(tmp_path, posts, max_frames=100, max_pixels=10_000, max_video_frames=20)
    refused(long, "/seconds", 100 / ASK["fps"])
    refused(film, "/seconds", 20 / ASK["fps"])
    refused(wide, "/picture/width", 10_000 / 100)
    assert right.status_code == 200


def test_what_a_format_can_not_hold_is_refused(server):
    refused(post(server, "image/gif", fps=60, picture=SMALL), "/fps", 50)
    refused(post(server, "image/png", picture={**SMALL, "frame": 30}), "/picture/frame", 29)


@pytest.mark.parametrize("media_type", ["application/json", "text/csv", "model/x-bvh"])
def test_long_motions_come_in_parts_and_are_whole(server, media_type):
    ask = {"seed": 1, "seconds": 60, "fps": 60}
    with server.http.stream("POST", "/v1/synthesis", json=ask, headers={"Accept": media_type}) as answer:
        assert "content-length" not in answer.headers
        body = b"".join(answer.iter_bytes())
    motion = motionenv.synthesize("walk/fpca", 60, 60, seed=1)
    if media_type == "application/json":
        np.testing.assert_array_equal(json.loads(body)["poses"], motion.poses)
    elif media_type == "text/csv":
        table = np.genfromtxt(io.BytesIO(body), delimiter=",", names=True)
        np.testing.assert_array_equal(table["right_knee_flexion_rad"], motion.poses[:, -1])
    else:
        assert body.count(b"\n") > 3600
