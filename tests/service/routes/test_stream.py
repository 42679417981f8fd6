"""`WS /v1/stream`: motion without end."""

import json
import time
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from motionenv.arguments import WALK_ARGUMENTS
from service.schemas.stream import StreamSettings

ROOT = Path(__file__).parents[3]


def talk(server, **settings):
    connection = connect(f"ws{server.url.removeprefix('http')}/v1/stream", **settings)
    return connection


def say(connection, **settings) -> dict:
    """Send settings; the answer, past frames that come before it."""
    connection.send(json.dumps(settings))
    while isinstance(message := connection.recv(timeout=60), bytes):
        pass
    return json.loads(message)


def frames(connection, n: int) -> np.ndarray:
    return np.array([np.frombuffer(connection.recv(timeout=10), "<f4") for _ in range(n)], dtype=np.float64)


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_motion_comes_at_its_pace_and_goes_on_when_it_changes(server, model):
    with talk(server) as connection:
        answer = say(connection, model=model, seed=1, fps=60, speed=1.2)
        assert (answer["type"], answer["fps"], len(answer["pose"])) == ("settings", 60, 25)
        begun = time.monotonic()
        poses = frames(connection, 90)
        assert 1.2 < time.monotonic() - begun < 4
        connection.send(json.dumps({"speed": 1.6}))
        after = []
        while len(after) < 60:
            message = connection.recv(timeout=10)
            if isinstance(message, bytes):
                after.append(np.frombuffer(message, "<f4"))
        whole = np.concatenate([poses, np.array(after, dtype=np.float64)])
    assert np.isfinite(whole).all()
    assert np.diff(whole[:, 0]).min() > -0.005  # never backwards
    assert np.abs(np.diff(whole, axis=0))[:, 3:].max() < 0.35  # no jumps: 20 rad/s at most
    assert np.abs(np.diff(whole, axis=0))[:, :3].max() < 0.06


def test_the_same_seed_gives_the_same_motion(server):
    runs = []
    for _ in range(2):
        with talk(server) as connection:
            say(connection, seed=4, fps=120)
            runs.append(frames(connection, 20))
    np.testing.assert_array_equal(*runs)


def test_wrong_settings_are_told_and_the_motion_goes_on(server):
    with talk(server) as connection:
        say(connection, seed=1, fps=60)
        assert say(connection, speed=100)["errors"][0]["field"] == "/speed"
        assert "no model" in say(connection, model="walk/nobody")["detail"]
        frames_came = 0
        while frames_came < 5:
            message = connection.recv(timeout=10)
            frames_came += isinstance(message, bytes)


def test_a_key_is_asked_for(locked):
    with pytest.raises(InvalidStatus, match="401"):
        talk(locked).close()
    with talk(locked, additional_headers={"Authorization": f"Bearer {locked.key}"}) as connection:
        assert say(connection, seed=1)["type"] == "settings"


@pytest.mark.parametrize(
    ("message", "code"), [(b"\x00\x01", 1003), (b"", 1003), ("{", 1007), ("[1, 2]", 1007), ("nobody", 1007), ("", 1007)]
)
@pytest.mark.parametrize("first", [True, False])
def test_a_message_that_cannot_be_read_ends_it_with_a_reason(server, message, code, first):
    with talk(server) as connection:
        if not first:
            say(connection, seed=1)
        connection.send(message)
        with pytest.raises(ConnectionClosed) as closed:  # noqa: PT012
            while True:
                connection.recv(timeout=30)
    assert closed.value.rcvd.code == code
    assert "JSON object" in closed.value.rcvd.reason
    assert f"| {code} |" in (ROOT / "docs" / "service.md").read_text()


def test_one_stream_too_many_is_told_when_to_come_back(job_server):
    with talk(job_server) as first:
        say(first, seed=1)
        with pytest.raises(InvalidStatus) as refused:
            talk(job_server).close()
    response = refused.value.response
    assert (response.status_code, json.loads(response.body)["type"]) == (503, "/docs#busy")
    assert int(response.headers["retry-after"]) > 0


def test_every_setting_is_documented():
    text = (ROOT / "docs" / "service.md").read_text().partition("## Stream")[2].partition("## Jobs")[0]
    for name in StreamSettings.model_fields.keys() - set(WALK_ARGUMENTS):
        assert f"`{name}`" in text
