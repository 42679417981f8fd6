"""Servers of one machine and of several are used alike."""

import inspect

import pytest

from service.cluster.backend import Cluster
from service.cluster.counts import SharedStreams
from service.cluster.models import SharedModels
from service.cluster.objects import SharedFiles
from service.cluster.postgres import PostgresStore
from service.jobs.backend import Backend, Local, LocalStreams, Streams
from service.jobs.file_store import FileStore
from service.jobs.sqlite import SqliteStore
from service.jobs.store import Store
from service.model_registry import ModelRegistry


@pytest.mark.parametrize(
    ("interface", "kind"),
    [
        (Backend, Local), (Backend, Cluster), (Store, SqliteStore), (Store, PostgresStore), (Streams, LocalStreams),
        (Streams, SharedStreams), (FileStore, SharedFiles), (ModelRegistry, SharedModels),
    ],
)  # fmt: skip
def test_every_method_is_there_and_takes_the_same(interface, kind):
    methods = {name for name, _ in inspect.getmembers(interface, inspect.isfunction) if not name.startswith("_")}
    assert methods
    for name in methods:
        asked, given = getattr(interface, name), getattr(kind, name)
        assert inspect.signature(asked) == inspect.signature(given)
        assert inspect.iscoroutinefunction(asked) == inspect.iscoroutinefunction(given)
        if interface in (Backend, Store, Streams):
            assert given is not asked, f"{kind.__name__}.{name} is the interface's own"
