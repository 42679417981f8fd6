"""The application: `create_app(settings)`."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from starlette.middleware.cors import CORSMiddleware

from motionenv import __version__
from service import documentation, problems
from service.admission import Workshop
from service.catalogue import Catalogue
from service.jobs.desk import Desk
from service.metrics import Metrics
from service.middleware import Guarding, Observing
from service.routes import docs, health, jobs, lift, models, page, parameters, stream, synthesis, tree
from service.settings import Settings


class Service:
    """What the routes share, as `request.app.state.service`.

    Args:
        settings: of the service.

    Attributes:
        catalogue: the models.
        metrics: the counts.
        workshop: threads that compute.
        painter: the one thread that OpenGL is called from.
        jobs: work for processes of its own.
        ready: whether the models are loaded.
        streams: how many WebSockets get motion.
    """

    def __init__(self, settings: Settings):
        self.settings, self.metrics = settings, Metrics()
        self.catalogue = Catalogue(settings.data / "models")
        self.workshop = Workshop(settings.threads, settings.waiting, self.metrics.computing)
        self.painter = Workshop(1, settings.waiting, self.metrics.computing, name="opengl")
        self.jobs = Desk(settings, self.catalogue, self.metrics)
        self.ready, self.streams = False, 0


def create_app(settings: Settings | None = None) -> FastAPI:
    """The service as an ASGI application.

    Args:
        settings: None takes those of the environment.
    """
    service = Service(settings or Settings())

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        service.catalogue.load()
        parameters.prepare(service.catalogue)
        service.jobs.open()
        service.ready = True
        yield
        service.ready = False
        await service.jobs.close()
        service.workshop.close()
        service.painter.close()

    app = FastAPI(
        title="motionenv", version=__version__, lifespan=lifespan, redirect_slashes=False, docs_url=None,
        redoc_url=None, telemetry={"tracing": False, "metrics": False, "logs": False},
    )  # fmt: skip
    app.state.service = service
    app.add_middleware(Guarding, settings=service.settings)
    if service.settings.cors:
        app.add_middleware(
            CORSMiddleware, allow_origins=service.settings.cors, allow_methods=["*"], allow_headers=["*"],
            expose_headers=["ETag", "Location", "Motion-Seed", "Retry-After", "X-Request-ID"],
        )  # fmt: skip
    app.add_middleware(Observing, settings=service.settings, metrics=service.metrics)
    problems.install(app)
    if service.settings.keys:
        documentation.ask_for_keys(app)
    for module in (synthesis, tree, lift, health, jobs, models, stream, parameters, page, docs):  # the busiest first
        app.router.routes.extend(module.router.routes)  # an included router would be looked through twice
    return app
