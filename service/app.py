"""The application: `create_app(settings)`."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib import import_module

from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from starlette.middleware.cors import CORSMiddleware

from motionenv import __version__
from service import errors
from service.jobs.backend import Backend
from service.jobs.manager import JobManager
from service.observability.metrics import Metrics
from service.routes import docs, page, parameters
from service.settings import Settings
from service.transport.access import AccessMiddleware
from service.transport.compression import CompressionMiddleware
from service.transport.middleware import ObservabilityMiddleware
from service.transport.worker_pool import WorkerPool

_MOST_USED_FIRST = (
    "synthesis", "cycles", "tree", "lift", "gait", "stimuli", "health", "uploads", "jobs", "models", "stream",
    "parameters", "page", "docs",
)  # fmt: skip


class Service:
    """State shared by the routes, as `request.app.state.service`."""

    def __init__(self, settings: Settings) -> None:
        self.settings, self.metrics = settings, Metrics()
        self.backend = Backend(settings)
        self.model_registry = self.backend.models
        self.streams = asyncio.Semaphore(settings.streams)  # of this process
        self.worker_pool = WorkerPool(settings.threads, settings.waiting, self.metrics.computing)
        self.jobs = JobManager(settings, self.backend)
        self.parted: tuple[str | None, bytes] = None, b""  # ETag and body of which a client last asked for parts
        self.ready = False  # whether the models are loaded


def create_app(settings: Settings | None = None) -> FastAPI:
    """Create the ASGI application; without `settings`, they are read from the environment."""
    service = Service(settings or Settings())

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        service.model_registry.load()
        parameters.prepare(service.model_registry)
        await service.backend.open()
        service.ready = True
        yield
        service.ready = False
        await service.backend.close()
        service.worker_pool.close()

    app = FastAPI(
        title="motionenv", version=__version__, description=docs.DESCRIPTION, lifespan=lifespan,
        redirect_slashes=False, docs_url=None, redoc_url=None,  # FastAPI's load their scripts from a CDN
        servers=[{"url": "/"}], license_info={"name": "MIT", "identifier": "MIT"},
        generate_unique_id_function=lambda route: route.name, telemetry={"metrics": False, "logs": False},  # its own
    )  # fmt: skip
    app.state.service = service
    app.add_middleware(CompressionMiddleware)
    app.add_middleware(AccessMiddleware, settings=service.settings, counts=service.backend.counts)
    if service.settings.cors:
        app.add_middleware(
            CORSMiddleware, allow_origins=service.settings.cors, allow_methods=["*"], allow_headers=["*"],
            expose_headers=["ETag", "Location", "Motion-Seed", "Motion-Warning", "RateLimit",
                            "RateLimit-Policy", "Retry-After", "X-Request-ID"],
        )  # fmt: skip
    app.add_middleware(ObservabilityMiddleware, settings=service.settings, metrics=service.metrics)
    errors.install(app)
    if service.settings.all_keys:
        docs.require_keys(app)
    for name in _MOST_USED_FIRST:
        app.include_router(import_module(f"service.routes.{name}").router)
    app.mount("/assets", page.ASSETS)
    app.mount("/docs", docs.ASSETS)
    app.state.paths = _methods(app)
    return app


def _methods(app: FastAPI) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for route in iter_route_contexts(app.routes):
        methods = route.methods or set()
        found.setdefault(route.path or "", set()).update(methods | ({"HEAD"} if "GET" in methods else set()))
    return found
