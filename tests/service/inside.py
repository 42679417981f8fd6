"""The application in this process: what needs no server costs none."""

import asyncio
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import httpx

from service.app import create_app
from service.settings import Settings


def answers(data: Path, requests: Iterable[tuple[str, str, dict[str, Any]]], **settings: Any) -> list[httpx.Response]:
    """What an application with `settings` answers to (method, path, how), one after the other."""
    app = create_app(Settings(data=data, **settings))

    async def ask() -> list[httpx.Response]:
        transport = httpx.ASGITransport(app)
        async with app.router.lifespan_context(app):
            async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
                return [await client.request(method, path, **how) for method, path, how in requests]

    return asyncio.run(ask())
