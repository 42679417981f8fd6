"""What the tests of the service share: one that takes jobs, and the page in a browser."""

import asyncio
from collections.abc import Iterator

import pytest

from tests.service.page.browsing import Tab, launched, tab
from tests.service.running import Server, run_service


@pytest.fixture(scope="session")
def job_server(tmp_path_factory) -> Iterator[Server]:
    """A service with little memory and room for few jobs, and for one stream."""
    limits = {"job_memory": 1_500_000_000, "job_waiting": 3, "job_seconds": 120, "reserve": 1_000_000, "streams": 1}
    with run_service(tmp_path_factory.mktemp("jobs"), **limits) as running:
        yield running


@pytest.fixture
def runner() -> Iterator[asyncio.Runner]:
    """An event loop that stays the same."""
    with asyncio.Runner() as running:
        yield running


@pytest.fixture(scope="module")
def browser():
    """Chromium."""
    with launched() as running:
        yield running


@pytest.fixture(scope="module")
def shown(browser, server) -> Tab:
    """The page, which tests share; each begins by opening a state of its own."""
    return tab(browser, server.url, walking=True)
