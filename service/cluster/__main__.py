"""`python -m service.cluster`, which `motionenv work` runs."""

import asyncio
import logging
import sys

from service.cluster.worker import Worker, WorkerSettings
from service.jobs.store import Unreachable
from service.observability import logs
from service.settings import from_command_line

settings = from_command_line(WorkerSettings)
logs.configure()
logging.getLogger("procrastinate").setLevel(logging.WARNING)
try:
    asyncio.run(Worker(settings).work())
except Unreachable:
    told = "can't reach the database: is it running, and is --database right?"
    print(f"motionenv work: {told}", file=sys.stderr)  # noqa: T201 the command's own words
    sys.exit(3)
