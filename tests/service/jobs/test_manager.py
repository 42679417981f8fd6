"""What lies between requests and jobs: refusals before any work, and jobs found again."""

import asyncio
import contextlib
import fcntl
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import motionenv
from service.errors import Problem
from service.jobs.backend import Backend
from service.jobs.manager import JobManager
from service.jobs.store import Job, SqliteStore
from service.jobs.uploads import Received
from service.schemas.jobs import RenderRequest
from service.settings import Settings
from service.transport.access import EVERYTHING, Access
from tests.service.jobs.blocking import Blocking
from tests.service.jobs.handing import LONG, as_file, uploads


def test_the_disk_reserve_is_kept(serving, tmp_path):
    motion = as_file(motionenv.synthesize("walk/fpca", 0.5, 60, seed=77), ".npz")
    store = SqliteStore(tmp_path / "jobs.sqlite", lambda: False)
    settings = {"request": RenderRequest(**LONG).model_dump(exclude={"format"}), "suffix": ".mp4"}
    kept = Job("kept", "render", settings, None, "video/mp4", "walk.mp4", time.time())
    asyncio.run(store.add(kept, [], most=1, idempotency=None, place=lambda: None))
    store.close()
    with serving(tmp_path, reserve=10**15) as server:
        for answer in (
            server.http.post("/v1/jobs/inspect", files=uploads({"a.npz": motion})),
            server.http.post("/v1/jobs/render", json=LONG),
        ):
            assert (answer.status_code, "disk is full" in answer.text) == (507, True)
        assert not list((tmp_path / "incoming").iterdir())
        assert server.http.delete("/v1/jobs/kept").json()["status"] == "cancelled"
        assert server.http.delete("/v1/jobs/kept").status_code == 204


@contextmanager
def managing(data: Path, **settings) -> Iterator[Blocking]:
    """A manager whose jobs stay queued: the lock of the folder is held here, as if by another server process."""
    data.mkdir(exist_ok=True)
    given = Settings(data=data, **{"reserve": 0} | settings)
    with (data / "jobs.lock").open("wb") as lock, asyncio.Runner() as runner:
        fcntl.flock(lock, fcntl.LOCK_EX)
        manager = Blocking(JobManager(given, Backend(given)), runner)
        manager.backend.open()
        yield manager
        manager.backend.close()


def add(manager: Blocking, *files: Received, **how) -> Job:
    given = {"media_type": "application/json", "filename": "a.json", **how}
    kind, settings = given.pop("kind", "inspect"), given.pop("settings", {"fps": None, "replace": False})
    return manager.add(kind, settings, files, given.pop("access", EVERYTHING), **given)


def received_file(manager: Blocking, name: str, content: bytes) -> Received:
    file = manager.file_store.receive()
    file.write(content)
    return Received(name, file.close(), file)


def test_files_of_a_job_are_placed_with_it_and_go_with_it(tmp_path):
    with managing(tmp_path) as manager:
        first = add(manager, received_file(manager, "a.bvh", b"same"))
        second = add(manager, received_file(manager, "b.bvh", b"same"))
        (sha,) = manager.file_store.all()
        assert manager.file_store.path(sha).read_bytes() == b"same"
        for job, left in ((first, [sha]), (second, [])):
            manager.cancel(job)
            assert manager.get(job.id, EVERYTHING).status == "cancelled"
            manager.remove(manager.get(job.id, EVERYTHING))
            assert manager.file_store.all() == left
        with pytest.raises(Problem, match="were forgotten, or never were: GET /v1/jobs lists") as missing:
            manager.get(first.id, EVERYTHING)
        assert missing.value.status_code == 404


def test_a_job_that_is_not_done_has_no_result(tmp_path):
    with managing(tmp_path) as manager:
        job = add(manager)
        with pytest.raises(Problem, match="the job is queued and has no result") as early:
            manager.result(manager.get(job.id, EVERYTHING))
        assert (early.value.status_code, early.value.headers) == (409, {"Retry-After": "1"})
        manager.cancel(job)
        manager.cancel(job)
        with pytest.raises(Problem, match="the job is cancelled and has no result") as never:
            manager.result(manager.get(job.id, EVERYTHING))
        assert (never.value.status_code, never.value.headers) == (409, {})


def test_more_jobs_than_may_wait_are_refused_before_and_after_their_body(tmp_path):
    with managing(tmp_path, job_waiting=2) as manager:
        manager.check_open("inspect")
        add(manager)
        add(manager)
        for refusing in (lambda: manager.check_open("inspect"), lambda: add(manager)):
            with pytest.raises(Problem, match="2 jobs are queued already; retry in 10 s") as busy:
                refusing()
            assert (busy.value.status_code, busy.value.headers["Retry-After"]) == (503, "10")


def test_who_comes_when_the_queue_is_full_is_told_when_there_is_a_place(tmp_path):
    """Fits of 3 and of 9 minutes took 6 in the mean, on two processes: 3 minutes until one is done."""
    with managing(tmp_path, job_waiting=1, job_processes=2) as manager:
        for minutes in (3, 9):
            job = add(manager, kind="render")
            with contextlib.closing(sqlite3.connect(tmp_path / "jobs.sqlite")) as db, db:
                ended = "UPDATE jobs SET status = 'done', started = 1000, ended = ? WHERE id = ?"
                db.execute(ended, (1000 + 60 * minutes, job.id))
        add(manager, kind="render")
        with pytest.raises(Problem) as busy:
            manager.check_open("render")
        assert busy.value.headers["Retry-After"] == "180"


def test_a_request_that_is_repeated_with_its_key_is_the_same_job(tmp_path):
    with managing(tmp_path) as manager:
        job = add(manager, received_file(manager, "a.bvh", b"x"), key="one")
        assert add(manager, received_file(manager, "a.bvh", b"x"), key="one").id == job.id
        assert add(manager, kind="convert", key="one").id != job.id  # a key is of one kind
        for files, how in (((received_file(manager, "a.bvh", b"y"),), {}), ((), {"settings": {"fps": 30.0}})):
            with pytest.raises(Problem, match="this Idempotency-Key was used for another request") as refused:
                add(manager, *files, key="one", **how)
            assert (refused.value.status_code, refused.value.errors[0]["field"]) == (422, "Idempotency-Key")


def test_a_model_is_fitted_once_at_a_time_and_under_a_free_name(tmp_path):
    with managing(tmp_path) as manager:
        add(manager, kind="fit", model="fitted/mine")
        with pytest.raises(Problem, match="a job is making fitted/mine already: wait, cancel it, or choose") as taken:
            add(manager, kind="fit", model="fitted/mine")
        manager.model_registry.place("fitted/there", "").touch()
        with pytest.raises(Problem, match="model fitted/there exists already: set replace, remove it first") as there:
            add(manager, kind="fit", model="fitted/there")
        assert taken.value.status_code == there.value.status_code == 409
        manager.remove_model("fitted/there", EVERYTHING)
        assert add(manager, kind="fit", model="fitted/there").status == "queued"
        with pytest.raises(Problem, match="there is no model 'fitted/there'") as gone:
            manager.remove_model("fitted/there", EVERYTHING)
        assert gone.value.status_code == 404


ANNA, BERT = Access("anna", everything=False), Access("bert", everything=False)


def test_jobs_belong_to_who_made_them(tmp_path):
    with managing(tmp_path) as manager:
        hers, his = add(manager, access=ANNA, key="same"), add(manager, access=BERT, key="same")
        assert hers.id != his.id  # another one's Idempotency-Key tells nothing
        assert manager.get(hers.id, ANNA) == manager.get(hers.id, EVERYTHING) == hers
        with pytest.raises(Problem, match="were forgotten"):
            manager.get(hers.id, BERT)
        for access, seen in ((ANNA, [hers]), (BERT, [his]), (EVERYTHING, [his, hers])):
            assert manager.page(access, 10, None, None) == (seen, None)


def test_models_belong_to_who_made_them(tmp_path):
    with managing(tmp_path) as manager:
        registry = manager.model_registry
        model = motionenv.load("walk/fpca")
        for name, owner in (("hers", "anna"), ("everybodys", "")):
            model.save(registry.place(f"fitted/{name}", owner))
        assert [name for name in registry.names(BERT) if name.startswith("fitted/")] == ["fitted/everybodys"]
        assert registry.get("fitted/hers", ANNA).kind == registry.get("fitted/hers", EVERYTHING).kind == "walking"
        assert registry.get("fitted/everybodys", BERT).kind == "walking"
        for refused in (
            lambda: registry.get("fitted/hers", BERT),
            lambda: manager.remove_model("fitted/hers", BERT),
            lambda: manager.remove_model("fitted/everybodys", BERT),
        ):
            with pytest.raises(Problem, match="there is no model"):
                refused()
        with pytest.raises(Problem, match="the name fitted/hers is taken"):
            add(manager, kind="fit", model="fitted/hers", access=BERT, settings={"replace": True})
        assert add(manager, kind="fit", model="fitted/hers", access=ANNA, settings={"replace": True})
        manager.remove_model("fitted/hers", ANNA)
        assert registry.find_path("fitted/hers") is None


def test_a_page_keeps_its_place_when_jobs_go(tmp_path):
    with managing(tmp_path) as manager:
        jobs = [add(manager) for _ in range(7)][::-1]
        first, cursor = manager.page(EVERYTHING, 3, None, None)
        for job in (first[2], jobs[3]):
            manager.cancel(job)
            manager.remove(job)
        second, cursor = manager.page(EVERYTHING, 2, None, cursor)
        third, end = manager.page(EVERYTHING, 2, None, cursor)
        assert (first, second, third, end) == (jobs[:3], jobs[4:6], jobs[6:], None)
        for wrong in ("x", "", "AAAAAAAA", "////////", cursor + "=", cursor[:-1], "a" * 64, "zzzzzzzz", "é"):
            with pytest.raises(Problem, match="of an earlier page") as refused:
                manager.page(EVERYTHING, 2, None, wrong)
            assert refused.value.status_code == 400


def test_what_is_quick_waits_for_its_like_only(tmp_path):
    with managing(tmp_path, job_waiting=1) as manager:
        add(manager, kind="render", settings={})
        manager.check_open("inspect")
        quick = add(manager)
        for kind in ("fit", "convert"):
            with pytest.raises(Problem, match="1 jobs are queued already"):
                manager.check_open(kind)
        assert manager.store.claim("quick").id == quick.id
        assert manager.store.claim("quick") is None
        assert manager.store.claim("long").kind == "render"
