"""Endless motion at a frame rate: `WS /v1/stream`.

The client sends `StreamSettings` as JSON, those that change, at any time, the first one at once. The server answers
each with JSON, {"type": "settings", "fps", "height", "pose"} or {"type": "problem", "detail", "errors"}, and sends one
binary message per frame: 25 little-endian float32 [m, rad]. Messages that aren't JSON objects end the stream with a
close code and a reason. docs/service.md describes this for users.
"""

import asyncio
import time
from functools import partial

import orjson
from fastapi import APIRouter, WebSocket
from pydantic import ValidationError
from starlette.websockets import WebSocketDisconnect

from motionenv import MotionError
from motionenv.types import POSE
from service.errors import Problem, invalid, problem_response
from service.responses.streaming import Stream
from service.schemas.stream import StreamSettings
from service.transport.access import access_of

router = APIRouter(prefix="/v1", tags=["motion"])
_PATIENCE = 10.0  # [s] for the first message
_COME_BACK = 5  # [s] after which a client that was refused may try again
_BEHIND = 1.0  # [s] after which frames that are late are left out


@router.websocket("/stream")
async def stream(socket: WebSocket) -> None:
    """Send motion until the client goes."""
    service = socket.app.state.service
    if service.streams.locked():
        detail = f"{service.settings.streams} streams are open already; retry in {_COME_BACK} s"
        await _refuse(socket, detail, _COME_BACK)
        return
    async with service.streams:
        try:
            await socket.accept()
            await _Conversation(socket, service).run()
        except WebSocketDisconnect:
            pass
        except _Misunderstood as error:
            await socket.close(error.code, error.reason)


async def _refuse(socket: WebSocket, detail: str, seconds: int) -> None:
    """503 with a time to come back, or a close code where the server can't answer a handshake otherwise."""
    if "websocket.http.response" in socket.scope.get("extensions", {}):
        headers = {"Retry-After": str(seconds)}
        request_id = socket.scope.get("request_id")
        await socket.send_denial_response(problem_response(503, detail, headers=headers, request_id=request_id))
    else:
        await socket.close(1013, detail)


class _Misunderstood(Exception):
    """The conversation can't go on."""

    def __init__(self, code: int, reason: str):
        super().__init__(reason)
        self.code, self.reason = code, reason


class _Conversation:
    def __init__(self, socket: WebSocket, service) -> None:
        self.socket, self.service = socket, service
        self.stream: Stream | None = None
        self.turn = asyncio.Lock()  # what is sent must not move on while the next piece is joined to it

    async def run(self) -> None:
        """Listen and send until the client goes (WebSocketDisconnect), or isn't understood (_Misunderstood)."""
        while self.stream is None:
            try:
                async with asyncio.timeout(_PATIENCE):
                    said = await self._said()
            except TimeoutError:
                raise _Misunderstood(1008, f"no settings within {_PATIENCE:g} s") from None
            await self._hear(said)
        sending = asyncio.create_task(self._send())
        try:
            while True:
                hearing = asyncio.ensure_future(self._said())
                await asyncio.wait({hearing, sending}, return_when=asyncio.FIRST_COMPLETED)
                if sending.done():
                    hearing.cancel()
                    sending.result()
                await self._hear(await hearing)
        finally:
            sending.cancel()

    async def _said(self) -> dict:
        """The next message: those of the settings that change."""
        message = await self.socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(message.get("code", 1000))
        text = message.get("text")
        if text is None:
            raise _Misunderstood(1003, "messages must be text: settings as a JSON object")
        try:
            changed = orjson.loads(text)
        except orjson.JSONDecodeError:
            raise _Misunderstood(1007, "the message isn't JSON: settings are a JSON object") from None
        if not isinstance(changed, dict):
            raise _Misunderstood(1007, "settings must be a JSON object")
        return changed

    async def _hear(self, changed: dict) -> None:
        answer: dict
        try:
            now = self.stream.settings.model_dump() if self.stream else {}
            settings = StreamSettings.model_validate(now | changed)
            async with self.turn:
                await self.service.worker_pool.run(lambda: self._change(settings))
            assert self.stream is not None
            answer = {"type": "settings", "fps": self.stream.fps, "height": self.stream.height, "pose": POSE}
        except ValidationError as error:
            problem = invalid(error, StreamSettings)
            answer = {"type": "problem", "detail": problem.detail, "errors": problem.errors}
        except Problem as error:
            answer = {"type": "problem", "detail": error.detail, "errors": error.errors}
        except MotionError as error:
            answer = {"type": "problem", "detail": str(error), "errors": []}
        await self.socket.send_text(orjson.dumps(answer).decode())

    def _change(self, settings: StreamSettings) -> None:
        if self.stream is None:
            model = partial(self.service.model_registry.get, access=access_of(self.socket.scope))
            self.stream = Stream(model, settings)
        else:
            self.stream.change(settings)

    async def _send(self) -> None:
        assert self.stream is not None
        due = time.monotonic()
        while True:
            if not self.stream.settings.paused:
                async with self.turn:
                    pose = self.stream.next()
                await self.socket.send_bytes(pose.astype("<f4").tobytes())
            due += 1 / self.stream.fps
            now = time.monotonic()
            due = max(due, now - _BEHIND)
            await asyncio.sleep(due - now)
