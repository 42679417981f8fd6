"""Endless motion at a frame rate: `WS /v1/stream`.

The client sends `StreamSettings` as JSON, those that change, at any time, the first one at once. The server answers
each with JSON, {"type": "settings", "fps", "height", "pose"} or {"type": "problem", "detail", "errors"}, and sends one
binary message per frame: 25 little-endian float32 [m, rad].
"""

import asyncio
import time

import orjson
from fastapi import APIRouter, WebSocket
from pydantic import ValidationError
from starlette.websockets import WebSocketDisconnect, WebSocketState

from motionenv import MotionError
from motionenv.types import POSE
from service.errors import Problem, field_problem
from service.responses.streaming import Stream
from service.schemas.stream import StreamSettings

router = APIRouter(prefix="/v1", tags=["motion"])
_PATIENCE = 10.0  # [s] for the first message
_BEHIND = 1.0  # [s] after which frames that are late are left out


@router.websocket("/stream")
async def stream(socket: WebSocket) -> None:
    """Send motion until the client goes."""
    service = socket.app.state.service
    if service.streams >= service.settings.streams:
        await socket.close(1013, "too many streams: try again later")
        return
    service.streams += 1
    try:
        await socket.accept()
        await _Conversation(socket, service).run()
    except (WebSocketDisconnect, TimeoutError):
        pass
    finally:
        service.streams -= 1
        if socket.application_state == WebSocketState.CONNECTED and socket.client_state == WebSocketState.CONNECTED:
            await socket.close()


class _Conversation:
    def __init__(self, socket: WebSocket, service) -> None:
        self.socket, self.service = socket, service
        self.stream: Stream | None = None
        self.turn = asyncio.Lock()  # what is sent must not move on while the next piece is joined to it

    async def run(self) -> None:
        """Listen and send until the client goes (WebSocketDisconnect), or says nothing at first (TimeoutError)."""
        while self.stream is None:
            await self._hear(await asyncio.wait_for(self.socket.receive_text(), _PATIENCE))
        sending = asyncio.create_task(self._send())
        try:
            while True:
                hearing = asyncio.ensure_future(self.socket.receive_text())
                await asyncio.wait({hearing, sending}, return_when=asyncio.FIRST_COMPLETED)
                if sending.done():
                    hearing.cancel()
                    sending.result()
                await self._hear(await hearing)
        finally:
            sending.cancel()

    async def _hear(self, text: str) -> None:
        try:
            changed = orjson.loads(text)
            if not isinstance(changed, dict):
                raise Problem(422, "a message must be a JSON object")
            now = self.stream.settings.model_dump() if self.stream else {}
            settings = StreamSettings.model_validate(now | changed)
            async with self.turn:
                await self.service.worker_pool.run(lambda: self._change(settings))
            assert self.stream is not None
            answer = {"type": "settings", "fps": self.stream.fps, "height": self.stream.height, "pose": POSE}
        except orjson.JSONDecodeError:
            answer = {"type": "problem", "detail": "the message is no JSON", "errors": []}
        except ValidationError as error:
            errors = [field_problem({**e, "loc": ("body", *e["loc"])}) for e in error.errors()]
            answer = {"type": "problem", "detail": "the settings are wrong", "errors": errors}
        except (Problem, MotionError) as error:
            detail = error.detail if isinstance(error, Problem) else str(error)
            answer = {"type": "problem", "detail": detail, "errors": []}
        await self.socket.send_text(orjson.dumps(answer).decode())

    def _change(self, settings: StreamSettings) -> None:
        if self.stream is None:
            self.stream = Stream(self.service.model_registry.get, settings)
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
