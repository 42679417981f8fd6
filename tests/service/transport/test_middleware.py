"""Keys, sizes, rates, slow clients, problems: what every request meets."""

import asyncio
import base64
import gzip
import time

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from service.app import create_app
from service.settings import Settings
from service.transport.access import EVERYTHING, Access, access_of
from tests.service.inside import answers
from tests.service.running import raw
from tests.service.waiting import until

ASK = {"seed": 1, "seconds": 0.1}
_UPGRADE = {
    "Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}  # fmt: skip


@pytest.mark.parametrize("path", ["/v1/synthesis", "/v1/models", "/docs", "/openapi.json", "/metrics", "/", "/nothing"])
def test_without_a_key_there_is_no_answer(locked, path):
    answer = httpx.get(f"{locked.url}{path}")
    assert answer.status_code == 401
    assert answer.headers["content-type"] == "application/problem+json"
    assert "Basic" in answer.headers["www-authenticate"]


def test_the_key_comes_in_three_ways(locked):
    basic = base64.b64encode(f"anybody:{locked.key}".encode()).decode()
    for headers in (
        {"Authorization": f"Bearer {locked.key}"},
        {"X-API-Key": locked.key},
        {"Authorization": f"Basic {basic}"},
    ):
        assert httpx.get(f"{locked.url}/metrics", headers=headers).status_code == 200
    for headers in ({"Authorization": "Bearer wrong"}, {"X-API-Key": ""}, {"Authorization": "Basic %%%"}):
        assert httpx.get(f"{locked.url}/metrics", headers=headers).status_code == 401


def test_keys_are_never_logged(locked):
    locked.http.get("/health/live", params={"key": locked.key})
    locked.http.post("/v1/synthesis", json=ASK | {"model": locked.key})
    until(lambda: any(event["path"] == "/v1/synthesis" for event in locked.events("request")))
    assert not any(locked.key in line for line in locked.lines)


def test_bodies_have_a_limit(locked):
    for kind in ("application/json", "application/x+json", "text/plain"):
        long = locked.http.post("/v1/synthesis", content=b" " * 2001, headers={"Content-Type": kind})
        assert long.status_code == 413
    chunked = locked.http.post(
        "/v1/synthesis", content=iter([b" " * 1000] * 3), headers={"Content-Type": "application/json"}
    )
    assert chunked.status_code == 413
    assert "2000 bytes" in chunked.json()["detail"]


def test_rates_are_kept(tmp_path):
    """Of eleven requests in a row five pass in each minute of the clock that they fall into, two at most."""
    requests = [("GET", "/metrics", {})] * 11 + [("GET", "/health/live", {})]
    *told, health = answers(tmp_path, requests, rate=5)
    assert 5 <= [a.status_code for a in told].count(200) <= 10
    assert {a.status_code for a in told} == {200, 429}
    refused = next(a for a in told if a.status_code == 429)
    assert 1 <= int(refused.headers["retry-after"]) <= 60
    assert health.status_code == 200


def test_guesses_of_keys_count_against_the_rate_of_their_address(tmp_path):
    key = "a-key-that-only-tests-know"
    guess = ("GET", "/v1/body", {"headers": {"X-API-Key": "not-this-one-either"}})
    right = ("GET", "/v1/body", {"headers": {"X-API-Key": key}})
    *guesses, known, late = answers(tmp_path, [guess] * 9 + [right, guess], keys=(key,), rate=3)
    statuses = [answer.status_code for answer in guesses]
    assert 3 <= statuses.count(401) <= 6  # a minute of the clock may end meanwhile
    assert set(statuses) == {401, 429}
    assert 1 <= int(guesses[statuses.index(429)].headers["retry-after"]) <= 60
    assert known.status_code == 200  # who has a key has a rate of its own
    assert late.status_code in (401, 429)


def test_a_request_has_an_id(server):
    assert server.http.get("/health/live", headers={"X-Request-ID": "abc-1"}).headers["x-request-id"] == "abc-1"
    made = server.http.get("/health/live", headers={"X-Request-ID": "{jndi:ldap}"}).headers["x-request-id"]
    assert len(made) == 16
    wrong = server.http.post("/v1/synthesis", json={"seed": -1}, headers={"X-Request-ID": "abc-2"})
    assert wrong.json()["request_id"] == "abc-2"


def test_defects_and_delays_end_as_problems(tmp_path):
    app = create_app(Settings(data=tmp_path, request_seconds=1))
    app.add_api_route("/defect", lambda: 1 / 0)
    app.add_api_route("/delay", lambda: time.sleep(3))

    async def ask(path: str) -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return await client.get(path)

    for path, status in (("/defect", 500), ("/delay", 504)):
        answer = asyncio.run(ask(path))
        assert (answer.status_code, answer.json()["status"]) == (status, status)
        assert "division" not in answer.text


FORM = {"files": ("walk.bvh", b"HIERARCHY")}


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": "https://evil.example", "Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_pages_of_other_sites_may_look_but_not_act(server, headers):
    """Browsers send forms anywhere, in the name of whoever looks at the page, and ask nobody first."""
    answer = server.http.post("/v1/jobs/inspect", files=FORM, headers=headers)
    assert (answer.status_code, answer.headers["content-type"]) == (403, "application/problem+json")
    assert server.http.get("/v1/models", headers=headers).status_code == 200
    with pytest.raises(InvalidStatus, match="403"), talk(server, headers):
        pass


def test_the_services_own_page_and_programs_may_act(server):
    own = [{"Origin": server.url}, {"Origin": server.url, "Sec-Fetch-Site": "same-origin"}, {}]
    for headers in own:
        assert server.http.post("/v1/synthesis", json=ASK, headers=headers).status_code == 200
        with talk(server, headers):
            pass


@pytest.mark.parametrize(
    "host", ["evil.example:{}", "localhost.evil.example", "evil.example:@localhost", "0.0.0.0:{}", ""]
)
def test_a_name_that_is_made_to_lead_here_gets_nothing(server, host):
    """DNS rebinding: the page's site has this machine's address, so that its browser lets it read what comes."""
    host = host.format(server.http.base_url.port)
    headers = {"Host": host, "Origin": f"http://{host}", "Sec-Fetch-Site": "same-origin"}
    for method, path in (("GET", "/v1/models"), ("POST", "/v1/synthesis"), ("GET", "/"), ("GET", "/metrics")):
        answer = server.http.request(method, path, headers=headers)
        assert (answer.status_code, answer.headers["content-type"]) == (400, "application/problem+json")
        assert answer.json()["type"] == "/docs#wrong-host"
    opening = [f"{k}: {v}" for k, v in (headers | _UPGRADE).items()]
    answer, _ = raw(server.url, "\r\n".join(["GET /v1/stream HTTP/1.1", *opening, "\r\n"]).encode())
    assert answer.startswith(b"HTTP/1.1 400")


@pytest.mark.parametrize("host", ["localhost:{}", "LocalHost", "127.0.0.1", "[::1]:{}", "[::1]"])
def test_this_machines_names_lead_here(server, host):
    host = host.format(server.http.base_url.port)
    assert server.http.get("/v1/models", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    ("settings", "names"),
    [
        ({"hosts": ("motion.lab",)}, {"motion.lab": 200, "motion.lab:80": 200, "motionxlab": 400, "localhost": 200}),
        ({"host": "127.0.0.5"}, {"127.0.0.5": 200, "127.0.0.6": 400}),
        ({"keys": ("0123456789abcdef",)}, {"motion.lab": 401}),
        ({"host": "0.0.0.0", "open": True}, {"motion.lab": 200}),
    ],
)
def test_other_names_lead_here_where_they_are_listed_or_keys_are_asked(tmp_path, settings, names):
    requests = [("GET", "/v1/models", {"headers": {"Host": host}}) for host in names]
    told = answers(tmp_path, requests, **settings)
    assert [answer.status_code for answer in told] == list(names.values())


def test_pages_of_origins_in_cors_may_act_and_read_what_they_need(locked):
    theirs = {"Origin": "https://lab.example", "Sec-Fetch-Site": "cross-site"}
    answer = locked.http.post("/v1/synthesis", json=ASK, headers=theirs)
    assert answer.status_code == 200
    assert answer.headers["access-control-allow-origin"] == "https://lab.example"
    assert "Motion-Seed" in answer.headers["access-control-expose-headers"]
    other = {**theirs, "Origin": "https://evil.example"}
    assert locked.http.post("/v1/synthesis", json=ASK, headers=other).status_code == 403


def talk(server, headers):
    return connect(f"ws{server.url.removeprefix('http')}/v1/stream", additional_headers=headers)


def test_websockets_are_logged_without_the_key(locked):
    with talk(locked, {"Authorization": f"Bearer {locked.key}", "X-Request-ID": "a-stream"}) as connection:
        connection.send("{}")
        connection.recv(timeout=10)
    until(lambda: [event for event in locked.events("websocket") if event["request_id"] == "a-stream"])
    (found,) = [event for event in locked.events("websocket") if event["request_id"] == "a-stream"]
    assert (found["path"], len(found["key"])) == ("/v1/stream", 8)
    assert locked.key not in "".join(locked.lines)


def test_slow_uploads_have_their_time(tmp_path):
    """The deadline counts from the body's last part: ten parts take longer than an answer may."""
    app = create_app(Settings(data=tmp_path, request_seconds=0.4))

    async def parts():
        for _ in range(10):
            await asyncio.sleep(0.1)
            yield b" "
        yield b"{}"

    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            json_body = {"Content-Type": "application/json"}
            return await client.post("/v1/synthesis", content=parts(), headers=json_body)

    answer = asyncio.run(ask())
    assert answer.status_code == 503  # all of the body was read; models are loaded when the service starts, not here


@pytest.mark.parametrize("path", ["/v1/models", "/", "/health/live", "/v1/body", "/docs", "/metrics"])
def test_head_is_get_without_the_body(server, path):
    whole, head = server.http.get(path), server.http.head(path)
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-type"] == whole.headers["content-type"]
    assert head.headers.get("etag") == whole.headers.get("etag")
    assert server.http.head("/v1/cycles").status_code == 405
    until(lambda: any(event["method"] == "HEAD" and event["route"] == path for event in server.events("request")))


def test_a_wrong_key_is_not_told_as_none(locked):
    none, wrong = (httpx.get(f"{locked.url}/v1/models", headers=h) for h in ({}, {"X-API-Key": "not-this-one-either"}))
    assert (none.status_code, none.json()["type"]) == (401, "/docs#no-key")
    assert (wrong.status_code, wrong.json()["type"]) == (401, "/docs#unknown-key")
    assert 'error="invalid_token"' in wrong.headers["www-authenticate"]
    assert "error" not in none.headers["www-authenticate"]


def test_what_is_left_of_the_rate_is_told(tmp_path):
    *allowed, refused = answers(tmp_path, [("GET", "/v1/body", {})] * 4, rate=3)
    for left, answer in zip((2, 1, 0), allowed, strict=True):
        assert answer.status_code == 200
        assert answer.headers["ratelimit-policy"] == '"minute";q=3;w=60'
        assert answer.headers["ratelimit"].startswith(f'"minute";r={left};t=')
    assert (refused.status_code, refused.json()["type"]) == (429, "/docs#rate-limited")
    assert refused.headers["ratelimit"] == f'"minute";r=0;t={refused.headers["retry-after"]}'
    (free,) = answers(tmp_path / "other", [("GET", "/v1/body", {})])
    assert "ratelimit" not in free.headers


def test_without_keys_everything_is_everybodys():
    assert access_of({}) == EVERYTHING
    assert access_of({"key": None}).to("anybody")


def test_a_key_sees_its_own_and_an_admin_key_all():
    hers, admins = access_of({"key": "a1", "admin": False}), access_of({"key": "b2", "admin": True})
    assert hers == Access("a1", everything=False)
    assert (hers.to("a1"), hers.to("b2"), hers.to("")) == (True, False, False)
    assert (admins.to("a1"), admins.to(""), admins.owner) == (True, True, "b2")


LONG = {"seed": 1, "seconds": 60}


def asked_long(server, body, accept="application/json", encoding="gzip"):
    headers = {"Accept": accept, "Accept-Encoding": encoding, "Content-Type": "application/json"}
    with httpx.stream("POST", f"{server.url}/v1/synthesis", json=body, headers=headers, timeout=60) as answer:
        return answer.headers, b"".join(answer.iter_raw())


@pytest.mark.parametrize("accept", ["application/json", "text/csv", "model/x-bvh"])
def test_large_text_is_smaller_and_the_same(server, accept):
    plain, whole = asked_long(server, LONG, accept, encoding="identity")
    packed, body = asked_long(server, LONG, accept)
    assert "content-encoding" not in plain
    assert packed["content-encoding"] == "gzip"
    assert gzip.decompress(body) == whole
    assert len(body) < 0.6 * len(whole)
    assert packed["etag"] == "W/" + plain["etag"]
    assert plain["vary"] == packed["vary"] == "Accept, Accept-Encoding"
    again = server.http.post("/v1/synthesis", json=LONG, headers={"Accept": accept, "If-None-Match": packed["etag"]})
    assert again.status_code == 412


@pytest.mark.parametrize(
    ("body", "accept"),
    [({"seed": 1, "seconds": 0.1}, "application/json"), (LONG, "application/x-npz"), (LONG, "model/gltf-binary")],
)
def test_what_is_short_or_packed_already_stays(server, body, accept):
    headers, _ = asked_long(server, body, accept)
    assert "content-encoding" not in headers
    assert not headers["etag"].startswith("W/")
