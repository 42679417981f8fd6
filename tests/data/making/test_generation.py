"""Data sets made by several processes, killed, continued, and on stores that fail; and their manifests."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from motionenv.data import Specification, Store, generate, verify
from motionenv.data.making.generation import finish
from motionenv.data.making.manifest import begin, done, read_head, read_row, read_rows, row_name, write_row
from motionenv.data.store import MAKING
from motionenv.errors import MotionError
from tests.data.walks import EVERYTHING, SINGLE, digests

#: Shards that take about a tenth of a second each.
MANY = SINGLE.replace(frames=400, people={"views": 16})


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("undisturbed")
    generate(MANY, folder, workers=1)
    return digests(folder)


def make(folder, spec: Specification, *more: str) -> subprocess.Popen:
    """A process of its own that makes a data set."""
    (folder.parent / "spec.json").write_text(spec.json())
    command = [
        sys.executable,
        "-m",
        "motionenv",
        "dataset",
        "make",
        folder.parent / "spec.json",
        "--out",
        folder,
        *more,
    ]
    return subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # which shells ignore in the background
    )  # fmt: skip


def made_whole(folder) -> bool:
    """Whether a process of its own makes what is missing of `MANY`."""
    started = make(folder, MANY, "--workers", "2")
    started.communicate()
    return started.returncode == 0


@pytest.mark.slow
def test_two_workers_make_what_one_makes(undisturbed, tmp_path):
    made = generate(MANY, tmp_path, workers=2)
    assert made.complete
    assert (made.shards, made.failed, made.frames) == (tuple(range(20)), {}, 400)
    assert digests(tmp_path) == undisturbed
    assert verify(tmp_path) == {}


def test_jobs_of_an_array_make_the_whole_and_more_frames_go_on(tmp_path, undisturbed):
    first = generate(MANY.replace(frames=390), tmp_path, range(0, 7), workers=1)
    assert not first.complete
    assert first.missing == 13
    generate(MANY.replace(frames=390), tmp_path, range(5, 20), workers=1)
    last = generate(MANY, tmp_path, workers=1)
    assert last.shards == (19,)  # the last one had 10 frames only
    (tmp_path / "manifest" / row_name(MANY.replace(frames=390), 19)).unlink()
    assert digests(tmp_path) == undisturbed


def killed_often(folder, times: int, seed: int) -> int:
    """Makes `MANY` in a folder, killed at random moments; the number of kills that hit."""
    choice, hits = random.Random(seed), 0
    for _ in range(times):
        started = make(folder, MANY, "--workers", "2")
        try:
            started.wait(choice.uniform(1.0, 6.0))
        except subprocess.TimeoutExpired:
            hits += 1
        if started.poll() is None:
            os.killpg(started.pid, signal.SIGKILL)
        started.communicate()
        if (folder / "index").is_dir() and len(list((folder / "index").iterdir())) > 15:
            shutil.rmtree(folder)  # nearly done: begin anew, so that the next kill finds something to hit
    return hits


@pytest.mark.slow
def test_killed_and_continued_it_is_as_if_undisturbed(tmp_path, undisturbed):
    folder = tmp_path / "set"
    assert killed_often(folder, 4, seed=1) >= 2
    assert made_whole(folder)
    assert digests(folder) == undisturbed


@pytest.mark.benchmark
def test_killed_fifty_times(tmp_path, undisturbed):
    folder = tmp_path / "set"
    assert killed_often(folder, 50, seed=2) > 25
    assert made_whole(folder)
    assert digests(folder) == undisturbed


def test_two_makers_in_one_folder(tmp_path, undisturbed):
    folder = tmp_path / "set"
    both = [make(folder, MANY, "--workers", "1") for _ in range(2)]
    said = [started.communicate(timeout=300) for started in both]
    assert [started.returncode for started in both] == [0, 0], said
    assert digests(folder) == undisturbed


def test_makers_that_end_together_all_describe_the_whole(tmp_path):
    spec = SINGLE.replace(frames=4)
    generate(spec, tmp_path, workers=1, format="coco")
    before = digests(tmp_path)
    with ThreadPoolExecutor(8) as makers:
        for end in [makers.submit(finish, Store(tmp_path), spec, "coco") for _ in range(48)]:
            end.result()
    assert digests(tmp_path) == before


@pytest.mark.slow
def test_ctrl_c_can_be_continued(tmp_path, undisturbed):
    folder = tmp_path / "set"
    started = make(folder, MANY, "--workers", "2")
    while not (folder / "manifest").is_dir():
        time.sleep(0.05)
    os.killpg(started.pid, signal.SIGINT)
    _, err = started.communicate(timeout=60)
    assert started.returncode == 130, err
    assert "run the same command again to go on" in err
    assert made_whole(folder)
    assert digests(folder) == undisturbed


def test_a_full_disk_fails_what_does_not_fit_and_can_be_continued(tmp_path, undisturbed):
    script = (
        "import resource, sys; from motionenv.data import *\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, resource.RLIM_INFINITY))\n"
        "made = generate(Specification.read(sys.argv[1]), sys.argv[2], range(4), workers=1)\n"
        "print(len(made.shards), sorted(made.failed.items()))"
    )
    (tmp_path / "spec.json").write_text(MANY.json())
    folder = tmp_path / "set"
    done = subprocess.run(
        [sys.executable, "-c", script, tmp_path / "spec.json", folder], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("0 [(0, 'OSError: [Errno 27] File too large"), done.stdout + done.stderr
    assert not list(folder.rglob("*.tar"))
    assert not list(folder.glob(f"{MAKING}*"))
    generate(MANY, folder, workers=1)
    assert digests(folder) == undisturbed


def test_damage_is_found(tmp_path):
    generate(EVERYTHING, tmp_path, workers=1)
    tar = tmp_path / "shards" / "shard-000001.tar"
    content = bytearray(tar.read_bytes())
    content[1000] ^= 1
    tar.write_bytes(content)
    (tmp_path / "index" / "shard-000000.parquet").unlink()
    (tmp_path / "manifest" / row_name(EVERYTHING, 2)).unlink()
    wrong = verify(tmp_path)
    assert set(wrong) == {"shards/shard-000001.tar", "index/shard-000000.parquet", "shard 2"}


def test_wrong_arguments(tmp_path):
    with pytest.raises(MotionError, match="shard must be from 0 to 2, got 9"):
        generate(EVERYTHING, tmp_path, [9])
    with pytest.raises(MotionError, match="format must be one of .*, got 'csv'"):
        generate(EVERYTHING, tmp_path, format="csv")
    with pytest.raises(MotionError, match="background must be plain, clutter or a folder of .*, got 'cluter'"):
        generate(EVERYTHING.replace(pictures={"background": "cluter"}), tmp_path / "new")
    assert not (tmp_path / "new").exists()
    (tmp_path / "file").touch()
    with pytest.raises(MotionError, match="can't write to"):
        generate(EVERYTHING, tmp_path / "file")


MEMORY = """
import resource, sys
from motionenv.data import Sampler, Specification
spec = Specification.read("silhouette-gait").replace(clip=10, frames=10**6, pictures={"width": 32, "height": 32})
used = []
for k, _ in enumerate(Sampler(spec).samples(0, 20_000)):
    if k in (2000, 19_999):
        used.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
print(used[1] - used[0])
"""


@pytest.mark.slow
def test_memory_is_flat_over_200_000_frames():
    done = subprocess.run([sys.executable, "-c", MEMORY], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 30_000  # kB


SPEC = Specification(frames=100, output={"shard": 40})


@pytest.fixture
def store(tmp_path) -> Store:
    return Store(tmp_path)


def test_rows_tell_what_is_done(store):
    begin(store, SPEC, "webdataset", "never")
    assert read_head(store) == (SPEC, "webdataset")
    assert done(store, SPEC) == set()
    row = write_row(store, SPEC, 2, [{"path": "x", "bytes": 3, "sha256": "0"}])
    assert (row["start"], row["stop"], row["frames"]) == (80, 100, 20)
    assert done(store, SPEC) == {2}
    assert read_row(store, SPEC, 2) == row
    assert read_row(store, SPEC, 1) is None
    more = SPEC.replace(frames=300)
    begin(store, more, "webdataset", "always")
    assert done(store, more) == set()  # shard 2 was cut short: it must be made again
    others = [write_row(store, SPEC, shard, []) for shard in (1, 0)]
    assert read_rows(store, SPEC) == [*others[::-1], row]
    assert row_name(more, 2) == "000002-80-120.json"


@pytest.mark.parametrize(
    ("changes", "form", "told"),
    [
        ({"people": {"turning": 0.5}}, "webdataset", "another data set: people.turning differ"),
        ({"seed": 4}, "webdataset", "seed differ"),
        ({"people": {"models": ["walk/eigenwalkers"]}}, "webdataset", "models, people.models differ"),
        ({}, "coco", "format differ"),
        ({"frames": 50}, "webdataset", "a data set of 100 frames: give as many or more, got 50"),
    ],
)
def test_another_specification_is_refused(store, changes, form, told):
    begin(store, SPEC, "webdataset", "if-possible")
    begin(store, SPEC, "webdataset", "if-possible")
    with pytest.raises(MotionError, match=told):
        begin(store, SPEC.replace(**changes), form, "if-possible")


def test_when_to_go_on(store):
    with pytest.raises(MotionError, match="no data set in .* to go on with"):
        begin(store, SPEC, "webdataset", "always")
    with pytest.raises(MotionError, match="there is no data set in"):
        read_head(store)
    begin(store, SPEC, "webdataset", "never")
    with pytest.raises(MotionError, match="choose another place"):
        begin(store, SPEC, "webdataset", "never")
    with pytest.raises(MotionError, match="resume must be one of never, always, if-possible, got 'maybe'"):
        begin(store, SPEC, "webdataset", "maybe")
    store.write("dataset.json", b"{")
    with pytest.raises(MotionError, match="dataset.json in .* is damaged"):
        begin(store, SPEC, "webdataset", "always")
