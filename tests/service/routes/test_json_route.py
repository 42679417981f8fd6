"""Bodies that are JSON, and those that are not."""

import asyncio

import httpx
import pytest
from fastapi import APIRouter, FastAPI
from fastapi import Request as HttpRequest
from starlette.responses import Response

from service import errors
from service.errors import Problem
from service.routes.json_route import JsonRoute, parsed
from service.schemas.common import Request


@pytest.mark.parametrize("kind", ["application/json", "Application/JSON", "application/x+json", "text/plain"])
def test_json_by_any_name_is_as_short_as_json(locked, kind):
    answer = locked.http.post("/v1/synthesis", content=b" " * 2001, headers={"Content-Type": kind})
    assert answer.status_code == 413


class Asked(Request):
    n: int = 1
    at: tuple[float, ...] = ()


@pytest.fixture(scope="module")
def post():
    """A function that posts a body to an application with one route, which answers with what it was asked."""
    router = APIRouter(route_class=JsonRoute)

    @router.post("/echo")
    async def echo(request: HttpRequest, asked: Asked) -> Response:
        return Response(asked.model_dump_json(), media_type="application/json")

    app = FastAPI()
    app.router.routes.extend(router.routes)
    errors.install(app)

    def send(body: bytes, kind: str | None = "application/json") -> httpx.Response:
        async def ask() -> httpx.Response:
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                return await client.post("/echo", content=body, headers={} if kind is None else {"Content-Type": kind})

        return asyncio.run(ask())

    return send


@pytest.mark.parametrize("kind", ["application/json", "Application/JSON; charset=utf-8", "application/ld+json"])
def test_json_is_taken_by_all_of_its_names(post, kind):
    answer = post(b'{"n": 3, "at": [1, 2.5]}', kind)
    assert (answer.status_code, answer.json()) == (200, {"n": 3, "at": [1.0, 2.5]})


@pytest.mark.parametrize(
    "kind", [None, "", "text/plain", "text/json", "multipart/form-data", "application/x-www-form-urlencoded", "json"]
)
def test_what_a_form_of_another_site_can_send_is_refused(post, kind):
    """Browsers send these anywhere without asking first."""
    answer = post(b'{"n": 3}', kind)
    assert (answer.status_code, answer.headers["content-type"]) == (415, "application/problem+json")
    assert "Content-Type: application/json" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("body", "status", "fields"),
    [
        (b'{"n": "3"}', 422, ["/n"]),
        (b'{"n": 1.5, "at": [1, null]}', 422, ["/n", "/at/1"]),
        (b'{"m~/": 1}', 422, ["/m~0~1"]),
        (b"[]", 422, ["/"]),
        (b"", 400, ["/"]),
        (b'{"n": 1', 400, ["/"]),
        (b"\xff", 400, ["/"]),
    ],
)
def test_what_is_wrong_is_told_by_its_pointer(post, body, status, fields):
    answer = post(body)
    assert answer.status_code == status
    assert [error["field"] for error in answer.json()["errors"]] == fields


def test_who_goes_before_the_body_is_there_is_refused():
    async def gone() -> dict:
        return {"type": "http.disconnect"}

    scope = {"type": "http", "method": "POST", "headers": [(b"content-type", b"application/json")]}
    with pytest.raises(Problem, match="the client disconnected") as refused:
        asyncio.run(parsed(HttpRequest(scope, gone), Asked))
    assert refused.value.status_code == 400
