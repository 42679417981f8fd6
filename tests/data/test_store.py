import os
import pickle
import subprocess
import sys
import threading

import pytest

from motionenv.data import Store
from motionenv.data.store import MAKING
from motionenv.errors import MotionError


@pytest.fixture
def store(tmp_path) -> Store:
    return Store(tmp_path / "set")


def test_what_is_written_is_read_and_listed(store, tmp_path):
    assert store.names("") == []
    assert store.read("a/b.json") is None
    store.write("a/b.json", b"one")
    store.write("a/b.json", b"two")
    (tmp_path / "file").write_bytes(bytes(range(256)) * 1000)
    store.put(tmp_path / "file", "a/c/d.bin")
    assert store.read("a/b.json") == b"two"
    assert store.read("a/c/d.bin") == bytes(range(256)) * 1000
    assert store.names("a") == ["b.json", "c"]
    assert store.names("") == ["a"]
    again = pickle.loads(pickle.dumps(store))
    assert again.read("a/b.json") == b"two"


def test_a_reader_never_sees_half_a_file(tmp_path):
    store, seen, stop = Store(tmp_path), set(), threading.Event()
    contents = [bytes([k]) * 300_000 for k in range(2)]
    store.write("file", contents[0])

    def look() -> None:
        while not stop.is_set():
            seen.add((tmp_path / "file").read_bytes())

    reader = threading.Thread(target=look)
    reader.start()
    for k in range(60):
        store.write("file", contents[k % 2])
    stop.set()
    reader.join()
    assert seen <= set(contents)
    assert os.listdir(tmp_path) == ["file"]


def test_only_what_a_killed_process_left_is_swept(tmp_path):
    """Two processes hold unfinished files; one is killed."""
    script = (
        "import sys; from motionenv.data import Store\n"
        "with Store(sys.argv[1]).scratch() as folder:\n"
        "    (folder / 'part').write_text('half')\n"
        "    print('there', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", script, tmp_path]
    both = [subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    for each in both:
        assert each.stdout.readline() == "there\n"
    Store(tmp_path).sweep()
    assert len(list(tmp_path.glob(f"{MAKING}*/files/part"))) == 2
    both[0].kill()
    both[0].communicate()
    Store(tmp_path).sweep()
    assert len(list(tmp_path.glob(f"{MAKING}*/files/part"))) == 1
    both[1].communicate("")
    assert both[1].returncode == 0
    assert os.listdir(tmp_path) == []


def test_what_is_no_folder_is_refused(tmp_path):
    with pytest.raises(MotionError, match="a data set is made in a folder, got s3://sets/x: copy it there afterwards"):
        Store("s3://sets/x")
    (tmp_path / "plain").write_text("")
    with pytest.raises(OSError, match="plain"):
        Store(tmp_path / "plain").write("a", b"")
