"""Files by their content: stored once, whole, and never beyond the disk's reserve."""

import hashlib
import os

import pytest

import motionenv
from service.jobs.file_store import FileStore
from service.jobs.store import Full, full_disk_errors
from tests.service.jobs.handing import as_file, ended, uploads


def test_files_are_called_by_their_content_and_swept_when_stale(tmp_path):
    file_store = FileStore(tmp_path, reserve=0)
    for _ in range(2):
        file = file_store.receive()
        file.write(b"ab")
        file.write(b"c")
        sha = file.close()
        file_store.place(file.path, sha)
    assert sha == hashlib.sha256(b"abc").hexdigest()
    assert (file_store.path(sha).read_bytes(), file_store.all()) == (b"abc", [sha])
    left = file_store.receive()
    left.close()
    file_store.sweep_incoming()
    assert left.path.exists()
    os.utime(left.path, (0, 0))
    file_store.sweep_incoming()
    assert not left.path.exists()


def test_some_disk_is_kept_to_be_freed(tmp_path):
    file_store = FileStore(tmp_path, reserve=0)
    file_store.load_ballast()
    assert (tmp_path / "ballast").stat().st_blocks * 512 >= 4 << 20
    assert file_store.drop_ballast()
    assert not file_store.drop_ballast()
    with pytest.raises(Full):
        FileStore(tmp_path, reserve=10**18).check_room()


def test_equal_uploads_are_kept_once_and_go_with_the_last_job(job_server):
    motion = as_file(motionenv.synthesize("walk/fpca", 0.5, 60, seed=77), ".npz")
    jobs = [job_server.http.post("/v1/jobs/inspect", files=uploads({f"{i}.npz": motion})) for i in range(2)]
    sha = hashlib.sha256(motion).hexdigest()
    for answer in jobs:
        assert ended(job_server, answer)["status"] == "done"
        assert (job_server.data / "file_store" / sha[:2] / sha).read_bytes() == motion
        assert job_server.http.delete(answer.headers["Location"]).status_code == 204
    assert not (job_server.data / "file_store" / sha[:2] / sha).exists()


def test_what_is_discarded_is_gone_and_what_was_placed_stays(tmp_path):
    file_store = FileStore(tmp_path, reserve=0)
    for keep in (True, False):
        file = file_store.receive()
        file.write(b"kept" if keep else b"not wanted")
        sha = file.close()
        if keep:
            file_store.place(file.path, kept := sha)
        file.discard()
    assert file_store.all() == [kept]
    assert not list((tmp_path / "incoming").iterdir())
    assert (file_store.path(kept).stat().st_mode & 0o777) == 0o444
    file_store.remove(kept)
    file_store.remove(kept)
    assert file_store.all() == []


def test_a_full_disk_is_told_apart_from_other_errors(tmp_path):
    """/dev/full is a disk without any room."""
    with pytest.raises(Full), full_disk_errors(), open("/dev/full", "wb", buffering=0) as full:
        full.write(b"x")
    with pytest.raises(FileNotFoundError), full_disk_errors():
        open(tmp_path / "nothing")
