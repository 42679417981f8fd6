"""Run the service: uvicorn with uvloop and `GuardedHttpProtocol`, in one process or several."""

import os
import sys
import tempfile
from socket import socket
from typing import Any

import uvicorn
from prometheus_client.multiprocess import mark_process_dead
from uvicorn.supervisors import Multiprocess

from service.observability import logs
from service.settings import Settings
from service.transport.protocol import GuardedHttpProtocol


def application() -> Any:
    """The application of one worker, with settings from the environment."""
    from service.app import create_app

    logs.configure()
    return create_app(Settings())


def serve(settings: Settings) -> None:
    """Serve until SIGINT or SIGTERM; running requests are finished first.

    Worker processes read the settings from the environment, which this function sets.
    """
    os.environ.update(settings.environment())
    logs.configure()
    if settings.workers > 1:
        with tempfile.TemporaryDirectory(prefix="motionenv-metrics-") as counts:
            os.environ["PROMETHEUS_MULTIPROC_DIR"] = counts
            config = _config(settings)
            _Workers(config, sockets=[config.bind_socket()]).run()
        return
    server = uvicorn.Server(_config(settings))
    server.run()
    if not server.started:
        sys.exit(3)


class _Workers(Multiprocess):
    """Worker processes; those that end are replaced and their gauges dropped."""

    def __init__(self, config: uvicorn.Config, sockets: list[socket]):
        super().__init__(config, sockets)
        self._counted: set[int | None] = set()

    def keep_subprocess_alive(self) -> None:
        super().keep_subprocess_alive()
        alive = {process.pid for process in self.processes}
        for ended in self._counted - alive:
            mark_process_dead(ended)
        self._counted = alive


def _config(settings: Settings) -> uvicorn.Config:
    return uvicorn.Config(
        "service.server:application", factory=True, host=settings.host, port=settings.port, workers=settings.workers,
        loop="uvloop", http=GuardedHttpProtocol, ws="websockets-sansio", ws_max_size=65_536,
        access_log=False, log_config=None, server_header=False,
        proxy_headers=bool(settings.proxies), forwarded_allow_ips=settings.proxies or None,
        timeout_graceful_shutdown=round(settings.shutdown_seconds),
    )  # fmt: skip
