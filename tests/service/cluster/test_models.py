"""Models that machines share."""

import hashlib
import shutil
import time

import psycopg
import pytest

import motionenv
from service.cluster.models import SharedModels
from service.cluster.objects import SharedFiles
from service.errors import Problem
from service.jobs.store import Unreachable
from service.transport.access import EVERYTHING, Access
from tests.service.jobs.storing import shared_store


@pytest.fixture
def url(postgres, runner) -> str:
    """A database with its tables."""
    url = postgres.new()
    shared_store(url, runner).database.close()
    return url


@pytest.fixture
def machine(url, tmp_path):
    """Makes the models of machines by name."""
    made = []

    def new(name: str) -> SharedModels:
        folder = tmp_path / name
        files = SharedFiles(f"file://{tmp_path}/shared", folder, 0, 10**9)
        made.append(SharedModels(folder / "models", url, files))
        made[-1].folder.mkdir()
        return made[-1]

    yield new
    for models in made:
        models.close()


def publish(models: SharedModels, url: str, shipped: str, name: str, owner: str = "") -> None:
    """What a worker does when a fit is done."""
    path = models.folder.parent / "model.npz"
    motionenv.load(shipped).save(path)
    sha = hashlib.sha256(path.read_bytes()).hexdigest()
    models.publish(path, name, owner, sha)
    with psycopg.connect(url) as connection:
        connection.execute(
            "INSERT INTO motionenv_models VALUES (%s, %s, %s, %s) ON CONFLICT (name) DO UPDATE "
            "SET sha = excluded.sha, changed = excluded.changed", (name, owner, sha, time.time_ns()),
        )  # fmt: skip


def test_a_model_is_there_when_it_is_asked_for_and_of_one_version_everywhere(machine, url):
    one, two = machine("one"), machine("two")
    with pytest.raises(Problem, match="there is no model"):
        two.get("fitted/ours", EVERYTHING)
    publish(one, url, "walk/fpca", "fitted/ours")
    assert [models.get("fitted/ours", EVERYTHING).kind for models in (one, two)] == ["walking"] * 2
    assert one.version("fitted/ours") == two.version("fitted/ours")
    before = one.version("fitted/ours")
    publish(two, url, "walk/eigenwalkers", "fitted/ours")
    assert one.version("fitted/ours") == before  # until it learns of it
    for models in (one, two):
        models.refresh()
    assert [models.get("fitted/ours", EVERYTHING).kind for models in (one, two)] == ["eigenwalkers"] * 2
    assert one.version("fitted/ours") == two.version("fitted/ours") != before


def test_what_is_removed_goes_everywhere_and_what_is_lost_comes_again(machine, url):
    one, two = machine("one"), machine("two")
    publish(one, url, "walk/fpca", "fitted/hers", "anna")
    two.refresh()
    assert two.owner_of(two.find_path("fitted/hers")) == "anna"
    with pytest.raises(Problem, match="there is no model"):
        two.get("fitted/hers", Access("bert", everything=False))
    shutil.rmtree(two.folder)
    two.folder.mkdir()
    again = machine("three")
    assert again.find_path("fitted/hers").exists()
    with psycopg.connect(url) as connection:
        connection.execute("DELETE FROM motionenv_models")
    again.refresh()
    assert again.find_path("fitted/hers") is None
    assert not list(again.folder.iterdir())


def test_a_connection_that_breaks_is_made_again_and_a_database_that_is_away_is_told(machine, url):
    models = machine("one")
    models.refresh()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE pid <> pg_backend_pid() "
                           "AND datname = current_database()")  # fmt: skip
    models.refresh()
    models._url = "postgresql://nobody@127.0.0.1:9/none"
    models.close()
    with pytest.raises(Unreachable):
        models.find_path("fitted/ours")
