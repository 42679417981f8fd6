"""What the service is compared with: Starlette alone, on uvicorn with the same settings.

`/bytes` sends an answer that was made beforehand, `/work` makes the same walk as the service does, as JSON or NPZ, and
neither has keys, limits, checks of the request, metrics or a log.

Run by `service.py`: python benchmarks/service_bare.py MEDIA_TYPE
"""

import logging
import sys

import orjson
import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

import motionenv
from service.formats.motion import parts

_MODEL = "walk/fpca"


def application(media_type: str) -> Starlette:
    """The endpoints.

    Args:
        media_type: of their answers.
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
        application(sys.argv[1]), port=0, loop="uvloop", http="httptools", access_log=False, log_config=None,
        server_header=False,
    )  # fmt: skip
