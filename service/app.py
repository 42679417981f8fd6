"""The application: `create_app(settings)`."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.trustedhost import TrustedHostMiddleware

from motionenv import __version__
from service import errors
from service.jobs.manager import JobManager
from service.model_registry import ModelRegistry
from service.observability.metrics import Metrics
from service.observability.tracing import Tracer
from service.reference import asyncapi, openapi
from service.reference import page as docs
from service.routes import gait, health, jobs, lift, models, page, parameters, stimuli, stream, synthesis, tree, uploads
from service.settings import Settings
from service.transport.access import AccessMiddleware, trusted_hosts
from service.transport.compression import CompressionMiddleware
from service.transport.middleware import ObservabilityMiddleware
from service.transport.worker_pool import WorkerPool


class Service:
    """State shared by the routes, as `request.app.state.service`."""

    def __init__(self, settings: Settings):
        self.settings, self.metrics = settings, Metrics()
        self.model_registry = ModelRegistry(settings.data / "models")
        self.worker_pool = WorkerPool(settings.threads, settings.waiting, self.metrics.computing)
        self.opengl_pool = WorkerPool(1, settings.waiting, self.metrics.computing, name="opengl")  # contexts need one
        self.jobs = JobManager(settings, self.model_registry, self.metrics)
        self.tracer = Tracer(settings.traces, settings.trace_share) if settings.traces else None
        self.ready, self.streams = False, 0  # whether the models are loaded; number of open WebSockets


def create_app(settings: Settings | None = None) -> FastAPI:
    """Create the ASGI application; without `settings`, they are read from the environment."""
    service = Service(settings or Settings())

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        service.model_registry.load()
        parameters.prepare(service.model_registry)
        service.jobs.open()
        service.ready = True
        yield
        service.ready = False
        await service.jobs.close()
        service.worker_pool.close()
        service.opengl_pool.close()
        if service.tracer is not None:
            service.tracer.close()

    app = FastAPI(
        title="motionenv", version=__version__, lifespan=lifespan, redirect_slashes=False, docs_url=None,
        redoc_url=None, telemetry={"tracing": False, "metrics": False, "logs": False},
    )  # fmt: skip
    app.state.service = service
    app.add_middleware(CompressionMiddleware)
    app.add_middleware(AccessMiddleware, settings=service.settings)
    if service.settings.cors:
        app.add_middleware(
            CORSMiddleware, allow_origins=service.settings.cors, allow_methods=["*"], allow_headers=["*"],
            expose_headers=["ETag", "Location", "Motion-Seed", "Motion-Warning", "RateLimit",
                            "RateLimit-Policy", "Retry-After", "X-Request-ID"],
        )  # fmt: skip
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=trusted_hosts(service.settings), www_redirect=False)
    app.add_middleware(
        ObservabilityMiddleware, settings=service.settings, metrics=service.metrics, tracer=service.tracer
    )
    errors.install(app)
    if service.settings.all_keys:
        openapi.require_keys(app)
    most_used_first = (
        synthesis, tree, lift, gait, stimuli, health, uploads, jobs, models, stream, parameters, page, docs, asyncapi,
    )  # fmt: skip
    for module in most_used_first:
        for route in module.router.routes:
            app.router.routes.append(route)  # an included router would be matched twice
            if isinstance(route, APIRoute):
                route.unique_id = route.name  # operations are called as their functions
    return app
