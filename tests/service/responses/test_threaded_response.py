"""Answers made in threads stop when nobody listens."""

import asyncio
import contextlib
import io
import threading

import av
import numpy as np
import pytest

import motionenv
from service.errors import Problem
from service.responses.threaded_response import ThreadedResponse
from service.transport.worker_pool import WorkerPool


async def answered(made: ThreadedResponse, leaves_after: int | None = None) -> list[dict]:
    """What is sent to a client that leaves after so many messages."""
    sent: list[dict] = []
    left = asyncio.Event()

    async def receive() -> dict:
        await left.wait()
        return {"type": "http.disconnect"}

    async def send(message: dict) -> None:
        sent.append(message)
        if len(sent) == leaves_after:
            left.set()
            await asyncio.sleep(0.05)

    await made({"type": "http"}, receive, send)
    return sent


def counted(drawn: list[int], closed: threading.Event):
    """A film of 100 pictures that says how many were drawn."""

    def making(gone: threading.Event):
        def pictures():
            for i in range(100):
                drawn.append(i)
                yield np.full((48, 64, 3), i, np.uint8)

        with contextlib.ExitStack() as end:
            end.callback(closed.set)
            yield from motionenv.stream_video(pictures(), 30)

    return making


def frames(data: bytes) -> np.ndarray:
    with av.open(io.BytesIO(data)) as container:
        return np.stack([f.to_ndarray(format="rgb24") for f in container.decode(video=0)])


@pytest.mark.parametrize("leaves_after", [2, 4])
def test_no_picture_is_drawn_for_nobody(leaves_after):
    shop, drawn, closed = WorkerPool(2, 2), [], threading.Event()
    sent = asyncio.run(
        answered(ThreadedResponse(shop, counted(drawn, closed), "video/mp4", {}, whole=False), leaves_after)
    )
    assert closed.wait(2)
    assert len(drawn) <= 17 + 15 * leaves_after
    assert sent[0]["type"] == "http.response.start"
    assert "more_body" not in sent[-1] or sent[-1]["more_body"]
    assert shop.held == 0


def test_who_stays_gets_all():
    shop, drawn, closed = WorkerPool(2, 2), [], threading.Event()
    sent = asyncio.run(answered(ThreadedResponse(shop, counted(drawn, closed), "video/mp4", {}, whole=False)))
    assert len(drawn) == 100
    assert len(frames(b"".join(m.get("body", b"") for m in sent))) == 100
    assert not sent[-1]["more_body"]


def test_no_more_films_are_drawn_than_there_are_threads_and_seats():
    shop = WorkerPool(1, 1)

    async def three() -> list:
        made = [ThreadedResponse(shop, counted([], threading.Event()), "video/mp4", {}, whole=True) for _ in range(3)]
        return await asyncio.gather(*map(answered, made), return_exceptions=True)

    results = asyncio.run(three())
    (refused,) = [r for r in results if isinstance(r, Problem)]
    assert refused.status_code == 503
    assert refused.headers["Retry-After"] == "2"  # two wait for one thread, 1 s each until more is known
    assert all(r[0]["status"] == 200 for r in results if isinstance(r, list))


def test_a_cancelled_answer_closes_its_film():
    shop, drawn, closed = WorkerPool(1, 1), [], threading.Event()

    async def cut() -> None:
        answering = asyncio.create_task(
            answered(ThreadedResponse(shop, counted(drawn, closed), "video/mp4", {}, whole=True))
        )
        while not drawn:
            await asyncio.sleep(0.001)
        answering.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await answering

    asyncio.run(cut())
    assert closed.wait(2)
    assert len(drawn) < 100
    assert shop.held == 0
