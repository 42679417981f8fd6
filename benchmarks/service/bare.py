"""Bare endpoints to compare the service with, on uvicorn with the same settings.

Starlette's `/bytes` sends a precomputed response, and `/work` synthesises the same walk as the service, as JSON or NPZ.
FastAPI's `/product` multiplies eight random numbers with a matrix to as many numbers as a walk has, as a measure of the
machine's speed. None has keys, limits, metrics or a log.

Run by `benchmarks.service`: python -m benchmarks.service.bare MEDIA_TYPE, or product
"""

import logging
import sys

import numpy as np
import orjson
import uvicorn
from fastapi import FastAPI
from pydantic import BaseModel
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

import motionenv
from service.formats.motion import parts

_MODEL = "walk/fpca"


class Asked(BaseModel):
    """Request body of `/product`."""

    seed: int
    seconds: float = 4.0
    fps: float = 30.0


def product() -> FastAPI:
    """The endpoint `/product`."""
    matrix = np.random.default_rng(1).standard_normal((8, 120 * 25))
    app = FastAPI(telemetry={"tracing": False, "metrics": False, "logs": False})

    @app.post("/product")
    async def made(asked: Asked) -> Response:
        poses = (np.random.default_rng(asked.seed).standard_normal(8) @ matrix).reshape(120, 25)
        body = orjson.dumps({"poses": poses}, option=orjson.OPT_SERIALIZE_NUMPY)
        return Response(body, media_type="application/json")

    @app.get("/health/ready")
    async def ready() -> Response:
        return Response(b"")

    return app


def application(media_type: str) -> Starlette:
    """The Starlette endpoints.

    Args:
        media_type: media type of the responses.
    """
    model = motionenv.load(_MODEL)
    made = lambda asked: b"".join(
        parts(
            motionenv.synthesize(model, asked["seconds"], asked["fps"], seed=asked["seed"]),
            media_type,
            _MODEL,
            asked["seed"],
        )
    )
    ready = made({"seconds": 4, "fps": 30, "seed": 1})

    async def same_bytes(request: Request) -> Response:
        await request.body()
        return Response(ready, media_type=media_type)

    async def same_work(request: Request) -> Response:
        return Response(made(orjson.loads(await request.body())), media_type=media_type)

    async def live(_: Request) -> Response:
        return Response(b"")

    routes = [Route("/bytes", same_bytes, methods=["POST"]), Route("/work", same_work, methods=["POST"])]
    return Starlette(routes=[*routes, Route("/health/ready", live)])


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO)
    uvicorn.run(
        product() if sys.argv[1] == "product" else application(sys.argv[1]), port=0, loop="uvloop", http="h11",
        access_log=False, log_config=None, server_header=False,
    )  # fmt: skip
