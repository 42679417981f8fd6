"""The AsyncAPI document is of version 3, refers only to what it holds, and says what the stream really does."""

import json

import httpx
import jsonschema
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from service.reference.asyncapi import CLOSES


@pytest.fixture(scope="module")
def told(server):
    return server.http.get("/asyncapi.json").json()


def refs(part):
    if isinstance(part, dict):
        yield from [part["$ref"]] if "$ref" in part else []
        for inner in part.values():
            yield from refs(inner)
    elif isinstance(part, list):
        for inner in part:
            yield from refs(inner)


def at(told, ref):
    found = told
    for name in ref.removeprefix("#/").split("/"):
        found = found[name]
    return found


def test_the_document_holds_together(told, server):
    assert told["asyncapi"] == "3.0.0"
    assert {"title", "version"} <= told["info"].keys()
    assert told["servers"]["this"] == {"host": server.url.removeprefix("http://"), "protocol": "ws"}
    own = {name: part for name, part in told.items() if name != "components"}
    for ref in refs(own):
        assert at(told, ref)
    assert {operation["action"] for operation in told["operations"].values()} == {"send", "receive"}
    for message in told["components"]["messages"].values():
        jsonschema.Draft202012Validator.check_schema(message["payload"])


def test_real_messages_are_as_it_says(told, server):
    messages = told["components"]["messages"]
    with connect(f"ws{server.url.removeprefix('http')}/v1/stream") as stream:
        said = []
        for settings in [one["payload"] for one in messages["settings"]["examples"]] + [{"fps": 1e9}]:
            jsonschema.validate(settings, messages["settings"]["payload"]) if "seed" in settings else None
            stream.send(json.dumps(settings))
            while isinstance(message := stream.recv(timeout=60), bytes):
                assert len(message) == messages["pose"]["payload"]["maxLength"]
            said.append(json.loads(message))
    jsonschema.validate(said[0], messages["accepted"]["payload"])
    jsonschema.validate(said[1], messages["accepted"]["payload"])
    jsonschema.validate(said[2], messages["problem"]["payload"])
    assert "/fps" in said[2]["detail"]
    assert "120" in said[2]["detail"]


@pytest.mark.parametrize(
    ("message", "code"), [(b"\x00\x01", 1003), (b"", 1003), ("{", 1007), ("[1, 2]", 1007), ("nobody", 1007), ("", 1007)]
)
@pytest.mark.parametrize("first", [True, False])
def test_what_is_no_settings_ends_it_with_a_reason(server, message, code, first):
    assert code in CLOSES
    with connect(f"ws{server.url.removeprefix('http')}/v1/stream") as stream:
        if not first:
            stream.send('{"seed": 1}')
        stream.send(message)
        with pytest.raises(ConnectionClosed) as closed:  # noqa: PT012
            while True:
                stream.recv(timeout=30)
    assert closed.value.rcvd.code == code
    assert "JSON object" in closed.value.rcvd.reason


def test_who_comes_too_late_is_told_when_to_come_back(job_server):
    address = f"ws{job_server.url.removeprefix('http')}/v1/stream"
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
               "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}  # fmt: skip
    with connect(address) as first:
        first.send('{"seed": 1}')
        first.recv(timeout=60)
        refused = httpx.get(f"{job_server.url}/v1/stream", headers=upgrade)
    assert refused.status_code == 503
    assert int(refused.headers["retry-after"]) > 0
    assert refused.json()["type"] == "/docs#busy"
    assert "1 streams are open" in refused.json()["detail"]
