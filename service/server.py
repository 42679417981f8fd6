"""Run the service: uvicorn with uvloop, in one process or several."""

import ctypes
import os
import sys
import tempfile
from typing import Any

import uvicorn
from uvicorn.supervisors import Multiprocess

from service.observability import logs
from service.settings import Settings

_HEADER_BYTES = 65_536
_ARENAS = -8, 2  # glibc's M_ARENA_MAX: by default each thread has memory of its own, which it keeps
_CONNECTIONS = 1_000  # of each process; more get 503
_IDLE_SECONDS = 15  # longer than clients (httpx: 5 s) and the proxy (10 s) keep a connection, or they lose requests


def application() -> Any:
    """The application of one worker, with settings from the environment."""
    from service.app import create_app

    if limit := getattr(ctypes.CDLL(None), "mallopt", None):
        limit(*_ARENAS)
    logs.configure()
    return create_app(Settings())


def serve(settings: Settings) -> None:
    """Serve until SIGINT or SIGTERM; running requests are finished first.

    Worker processes read the settings from the environment, which this function sets.
    """
    os.environ.update(settings.environment())
    logs.configure()
    config = uvicorn.Config(
        "service.server:application", factory=True, host=settings.host, port=settings.port, workers=settings.workers,
        loop="uvloop", http="h11", h11_max_incomplete_event_size=_HEADER_BYTES, limit_concurrency=_CONNECTIONS,
        ws="websockets-sansio", ws_max_size=65_536, access_log=False, log_config=None, server_header=False,
        proxy_headers=bool(settings.proxies), forwarded_allow_ips=settings.proxies or None,
        timeout_keep_alive=_IDLE_SECONDS, timeout_graceful_shutdown=round(settings.shutdown_seconds),
    )  # fmt: skip
    if settings.workers > 1:
        with tempfile.TemporaryDirectory(prefix="motionenv-metrics-") as counts:
            os.environ["PROMETHEUS_MULTIPROC_DIR"] = counts  # processes count together: see prometheus_client
            Multiprocess(config, sockets=[config.bind_socket()]).run()
        return
    server = uvicorn.Server(config)
    server.run()
    if not server.started:
        sys.exit(3)
