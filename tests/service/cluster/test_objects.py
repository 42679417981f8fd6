"""Files that machines share, with copies on each."""

import hashlib
import os
import subprocess
import sys
import time

import pytest

from service.cluster.objects import SharedFiles
from service.jobs.store import Unreachable
from tests.service.cluster.many import BUCKET
from tests.service.running import ORDINARY, ROOT


@pytest.fixture(params=["s3", "file"])
def url(request, tmp_path, monkeypatch) -> str:
    if request.param == "file":
        return f"file://{tmp_path}/shared"
    for name, value in request.getfixturevalue("s3").items():
        monkeypatch.setenv(name, value)
    return f"{BUCKET}/{tmp_path.name}"


@pytest.fixture
def machine(url, tmp_path):
    """Makes the files of machines by name."""
    return lambda name, cache=10**9: SharedFiles(url, tmp_path / name, 0, cache)


def placed(files: SharedFiles, content: bytes) -> str:
    file = files.receive()
    file.write(content)
    sha = file.close()
    files.place(file.path, sha)
    assert not file.path.exists()
    return sha


def test_what_one_places_the_other_gets(machine):
    one, two = machine("one"), machine("two")
    sha = placed(one, b"walk")
    assert sha == hashlib.sha256(b"walk").hexdigest()
    assert two.fetch(sha).read_bytes() == one.fetch(sha).read_bytes() == b"walk"
    assert two.fetch(sha).parent.parent.parent == two.folder
    assert placed(two, b"walk") == sha
    other = placed(two, b"run")
    assert sorted(one.all()) == sorted([sha, other])
    one.remove(sha)
    one.remove(sha)
    assert two.all() == [other]
    with pytest.raises(FileNotFoundError):
        one.fetch(sha)
    assert not list((one.folder / "incoming").iterdir())


def test_it_needs_no_rights_of_root(machine, url, tmp_path):
    sha = placed(machine("one"), b"walk")
    code = (
        "import sys; from pathlib import Path; from service.cluster.objects import SharedFiles\n"
        "print(SharedFiles(sys.argv[1], Path(sys.argv[2]), 0, 10**9).fetch(sys.argv[3]).read_text())"
    )
    done = subprocess.run(
        [*ORDINARY, sys.executable, "-c", code, url, tmp_path / "two", sha], cwd=ROOT, capture_output=True, text=True
    )
    assert done.stdout == "walk\n", done.stderr


def test_what_was_placed_before_can_be_placed_again(machine):
    """As after a connection that broke between the files and the database."""
    one = machine("one")
    file = one.receive()
    file.write(b"walk")
    sha = file.close()
    for _ in range(2):
        one.place(file.path, sha)
    one.objects.files.rm_file(one.objects.place(f"files/{sha[:2]}/{sha}"))
    one.place(file.path, sha)
    assert machine("two").fetch(sha).read_bytes() == b"walk"


def test_copies_are_trimmed_and_come_again(machine):
    files = machine("one", cache=25)
    shas = [placed(files, bytes([i]) * 10) for i in range(5)]
    for i, sha in enumerate(shas):
        os.utime(files.path(sha), (time.time() - 10_000 + i,) * 2)
    files.fetch(shas[0])  # used a moment ago
    files.trim()
    assert [files.path(sha).exists() for sha in shas] == [True, False, False, False, True]
    assert len(files.all()) == 5
    assert files.fetch(shas[2]).read_bytes() == bytes([2]) * 10


def test_a_file_that_is_not_what_its_name_says_is_not_given(machine):
    one, two = machine("one"), machine("two")
    sha = placed(one, b"walk")
    one.objects.files.pipe_file(one.objects.place(f"files/{sha[:2]}/{sha}"), b"wilk")
    with pytest.raises(Unreachable, match="another file"):
        two.fetch(sha)
    assert not two.path(sha).exists()


def test_a_store_that_does_not_answer_is_told(tmp_path):
    (tmp_path / "shared").write_bytes(b"a file, where a folder should be")
    files = SharedFiles(f"file://{tmp_path}/shared", tmp_path / "one", 0, 0)
    file = files.receive()
    file.write(b"walk")
    sha = file.close()
    with pytest.raises(Unreachable):
        files.place(file.path, sha)
