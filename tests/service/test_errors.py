"""Problems name the field, its bound and what to do, and never what was sent."""

import asyncio

import httpx
import pytest
from starlette.applications import Starlette
from starlette.routing import Route

import motionenv
from service import errors
from service.errors import FieldProblem, ProblemDetail
from tests.service.inside import answers
from tests.service.waiting import until


@pytest.mark.parametrize(
    ("body", "field", "status"),
    [
        (b'{"seed": false}', "/seed", 422),
        (b'{"fps": NaN}', "/fps", 422),
        (b'{"fps": 1e999}', "/fps", 422),
        (b'{"seconds": -1e9}', "/seconds", 422),
        (b'{"model": "\\ud800"}', "/model", 422),
        (b'{"model": "no/such"}', "/model", 404),
        (b'{"unheard": 1}', "/unheard", 422),
        (b"[" * 5000, None, 400),
        (b"{", None, 400),
        (b"\xff\xfe", None, 400),
        (b"[]", "/", 422),
        (b"", "/", 422),
        (b'{"seconds": "3"}', "/seconds", 422),
        (b'{"m~/": 1}', "/m~0~1", 422),
    ],
)
def test_what_is_wrong_is_told_by_field(server, body, field, status):
    answer = server.http.post("/v1/synthesis", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == status
    assert field is None or field in [error["field"] for error in problem["errors"]]


POINTS = [[[1.0, 2.0]] * 15] * 8
K = [[500, 0, 100], [0, 500, 100], [0, 0, 1]]


@pytest.mark.parametrize(
    ("path", "body", "fields"),
    [
        ("synthesis", {"speeds": [[0, 50]]}, ["/speeds"]),
        ("synthesis", {"speeds": [[1, 1], [0, 1]]}, ["/speeds"]),
        ("synthesis", {"speeds": [[0, 1]], "speed": 1}, ["/speed", "/speeds"]),
        ("synthesis", {"path": [[0, 0], [0, 0]]}, ["/path"]),
        ("synthesis", {"path": [[0, 0], [1, 0], [0, 0.1]]}, ["/path"]),
        ("synthesis", {"path": [[x * 1e4, 0] for x in (1, -1, 1, -1)]}, ["/path"]),
        ("synthesis", {"path": [[0, 0], [2, 0], [3, 1], [3, 3]], "speed": 3}, ["/path"]),
        ("synthesis", {"deviations": [0.0] * 9}, ["/deviations"]),
        ("synthesis", {"scores": [0.0], "deviations": [0.0]}, ["/deviations", "/scores"]),
        ("synthesis", {"scores": [100.0] * 3}, ["/scores"]),  # without bounds, a kernel would never end
        ("synthesis", {"scores": [1000.0] * 8, "model": "walk/prior"}, ["/scores"]),
        ("synthesis", {"seconds": 0.001}, ["/seconds", "/fps"]),
        ("cycles", {"seed": 1, "scores": [1.0]}, ["/seed", "/scores"]),
        ("tree/samples", {"start": "nothing"}, ["/start"]),
        ("tree/samples", {"start": "walk", "history": [[0.0] * 25] * 10}, ["/history", "/start"]),
        ("tree/synthesis", {"start": "nothing"}, ["/start"]),
        ("tree/synthesis", {"activity": "nothing"}, ["/activity"]),
        ("lift", {"points": POINTS}, ["/points"]),
        ("lift", {"points": [[[1, 2, 3]] * 15] * 8}, ["/points"]),
        ("lift", {"points": POINTS, "camera": {"K": K, "R": K}}, ["/camera/R", "/camera/t"]),
        ("lift", {"points": POINTS, "camera": {"K": K, "R": K, "t": [0, 0, 0]}}, ["/camera"]),
        ("lift", {"points": POINTS, "camera": {"K": K, "poses": []}}, ["/camera/poses", "/points"]),
        ("stimuli", {"seconds": 0.001}, ["/seconds", "/fps"]),
        ("stimuli", {"displays": [{"contrast": 0}]}, ["/displays/0/contrast", "/displays/0/background", "/displays"]),
    ],
)
def test_what_is_wrong_together_is_told_of_each_field(server, path, body, fields):
    more = {"fps": 30} if path == "lift" else {}
    answers_ = []

    def answered() -> bool:
        answers_.append(server.http.post(f"/v1/{path}", json=more | body))
        return answers_[-1].status_code != 503  # the tree is being made

    until(answered, 180)
    assert answers_[-1].status_code == 422
    assert [error["field"] for error in answers_[-1].json()["errors"]] == fields


def test_no_message_shows_numpy(server):
    """Smoothing a speed may exceed it by its rounding, which nobody asked for."""
    assert server.http.post("/v1/synthesis", json={"speeds": [[0, 1], [1, 0], [2, 3]]}).status_code == 200
    assert "np." not in server.http.post("/v1/synthesis", json={"speeds": [[0, 3.5]]}).text


@pytest.mark.parametrize("path", ["/v1/synthesis", "/v1/jobs/render"])
def test_the_bound_of_a_product_is_what_its_field_may_be(server, path):
    long, large = {"seconds": 3000, "fps": 30}, {"seconds": 1, "picture": {"width": 4000, "height": 1000}}
    for asked, field, bound in ((long, "/seconds", 1200.0), (large, "/picture/width", 2073.6)):
        problem = server.http.post(path, json=asked, headers={"Accept": "video/mp4, application/problem+json"}).json()
        assert [(e["field"], e["bound"]) for e in problem["errors"]] == [(field, {"le": bound})]


def test_a_bound_is_told_as_a_number(server):
    problem = server.http.post("/v1/synthesis", json={"fps": 1000}).json()
    assert problem["errors"][0]["bound"] == {"le": 240.0}


def test_a_long_path_is_not_sent_back_whole(server):
    answer = server.http.get(f"/{'x' * 30_000}")
    assert (answer.status_code, len(answer.content) < 400) == (404, True)


@pytest.mark.parametrize(
    ("place", "field"),
    [
        (("body", "fps"), "/fps"),
        (("body", "picture", "width"), "/picture/width"),
        (("body", "a/b", "m~n", 0), "/a~1b/m~0n/0"),
        (("body",), "/"),
        (("query", "limit"), "limit"),
        (("path", "job"), "job"),
    ],
)
def test_a_field_is_told_as_a_json_pointer(place, field):
    """RFC 6901 for bodies, the name for parameters."""
    found = errors.field_problem(
        {"type": "x", "loc": place, "msg": "no", "ctx": {"le": 3, "error": ValueError("secret")}}
    )
    assert found == {"field": field, "problem": "no", "bound": {"le": 3}}
    assert FieldProblem(**found).field == field
    assert errors.field_problem({"type": "x", "loc": place, "msg": "no"})["bound"] is None


def test_a_bound_is_in_the_unit_of_its_field():
    errors.at_most(300, 300, "/seconds", "seconds · fps", "frames", each=30)
    with pytest.raises(errors.Problem, match="seconds · fps must be at most 300 frames, got 301") as refused:
        errors.at_most(301, 300, "/seconds", "seconds · fps", "frames", each=30)
    assert refused.value.status_code == 422
    (told,) = refused.value.errors
    assert (told["field"], told["bound"]) == ("/seconds", {"le": 10.0})


def test_every_problem_is_as_the_document_says():
    texts = ["plain", "a lone surrogate \ud800", "é"]
    for status in (400, 404, 422, 503):
        for text in texts:
            answer = errors.problem_response(status, text, request_id="abc", errors=[{"field": "/a", "problem": "b"}])
            told = ProblemDetail.model_validate_json(answer.body)
            kind = told.type.removeprefix("/docs#")
            assert (told.status, told.title, told.request_id) == (status, errors.KINDS[kind][1], "abc")
            assert errors.KINDS[kind][0] == status
            assert told.errors == [FieldProblem(field="/a", problem="b", bound=None)]
            assert answer.headers["content-type"] == "application/problem+json"


def test_busy_says_when_to_come_again():
    problem = errors.busy("too many requests wait", seconds=7)
    assert (problem.status_code, problem.headers["Retry-After"]) == (503, "7")
    assert problem.detail == "too many requests wait; retry in 7 s"


def test_documented_statuses_are_those_asked_for_and_403_with_401():
    assert list(errors.documented(422, 401)) == [401, 403, 422]
    assert list(errors.documented(503)) == [503]
    assert errors.documented(503)[503]["description"] == "Service Unavailable"


@pytest.mark.parametrize(
    ("method", "path", "status", "says"),
    [
        ("GET", "/nowhere", 404, "not found: /nowhere; see /docs"),
        ("PUT", "/v1/models", 405, "method PUT is not allowed"),
        ("DELETE", "/v1/synthesis", 405, "method DELETE is not allowed"),
    ],
)
def test_what_there_is_not_is_a_problem_too(tmp_path, method, path, status, says):
    (answer,) = answers(tmp_path, [(method, path, {})])
    told = ProblemDetail(**answer.json())
    assert (answer.status_code, told.status, told.detail) == (status, status, says)
    assert answer.headers["content-type"] == "application/problem+json"
    if status == 405:
        allowed = answer.headers["allow"].split(", ")
        assert (
            sorted(allowed) == {"/v1/models": ["GET", "HEAD", "POST"], "/v1/synthesis": ["GET", "HEAD", "POST"]}[path]
        )


def test_errors_of_the_library_are_the_clients():
    app = Starlette(routes=[Route("/", lambda _: motionenv.synthesize("walk/fpca", 1, 30, speed=9))])
    errors.install(app)

    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return await client.get("/")

    answer = asyncio.run(ask())
    assert answer.status_code == 422
    assert "speed must be a number of m/s from 0.1 to 3, got 9" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("path", "body", "near"),
    [
        ("/v1/synthesis", {"sped": 1}, "/sped: there is no such field: did you mean speed?"),
        ("/v1/synthesis", {"picture": {"widht": 5}}, "/picture/widht: there is no such field: did you mean width?"),
        ("/v1/stimuli", {"displays": [{}, {"invert": True}]}, "/displays/1/invert: there is no such field: did you"),
        ("/v1/synthesis", {"model": "walk/fcpa"}, "did you mean walk/fpca?"),
        ("/v1/synthesys", {}, "did you mean /v1/synthesis?"),
        ("/v1/synthesis", {"qqqqqqqqqq": 1}, "/qqqqqqqqqq: there is no such field"),
    ],
)
def test_what_was_meant_is_guessed(server, path, body, near):
    assert near in server.http.post(path, json=body).json()["detail"]


def test_form_fields_are_guessed_too(server):
    answer = server.http.post("/v1/jobs/inspect", files=[("files", ("a.bvh", b"x"))], data={"fpss": "30"})
    assert answer.json()["detail"] == "/fpss: there is no such field: did you mean fps?"


@pytest.mark.parametrize("kind", ["application/json", "Application/JSON; charset=utf-8", "application/ld+json"])
def test_json_is_taken_by_all_of_its_names(server, kind):
    assert server.http.post("/v1/tree/samples", content=b"{}", headers={"Content-Type": kind}).status_code in (200, 503)


@pytest.mark.parametrize(
    "kind", [None, "", "text/plain", "text/json", "multipart/form-data", "application/x-www-form-urlencoded", "json"]
)
def test_a_form_of_another_site_is_refused(server, kind):
    """Browsers send these anywhere without asking first."""
    headers = {} if kind is None else {"Content-Type": kind}
    answer = server.http.post("/v1/synthesis", content=b'{"seed": 3}', headers=headers)
    assert (answer.status_code, answer.headers["content-type"]) == (415, "application/problem+json")
    assert "Content-Type: application/json" in answer.json()["detail"]
