"""Damaged captures, some hundreds of ways to damage each: the service survives, and says what is wrong.

The long run, 1,000 C3D files and 10,000 BVH and AMC files: pytest -m benchmark -s tests/service/hostile/test_files.py
"""

import sys
import time
from collections import Counter

import psutil
import pytest

import motionenv
from tests.mocap.readers.test_asfamc import AMC, ASF
from tests.service.hostile.mutating import mutated
from tests.service.jobs.handing import as_file, ended, result, uploads


def originals() -> dict[str, bytes]:
    """A file of each kind that capture comes in, made here."""
    motion = motionenv.synthesize("walk/fpca", 1, 60, seed=5)
    return {".c3d": as_file(motion, ".c3d"), ".bvh": as_file(motion, ".bvh"), ".amc": AMC.encode()}


def damaged(kinds: dict[str, int], seed: int) -> list[tuple[str, bytes]]:
    """So many damaged files of each kind, with names; each name's beginning finds the skeleton of AMC files."""
    files = originals()
    return [
        (f"01_{i:05d}{kind}", made)
        for kind, count in kinds.items()
        for i, made in enumerate(mutated(files[kind], count, seed))
    ]


def inspected(job_server, files: list[tuple[str, bytes]]) -> Counter:
    """What becomes of files that are handed in together: how many are read, or refused, or crash their process.

    Where one file spoils it for all, the halves are handed in again, until it is known which.
    """
    asf = [("01.asf", ASF.encode())] if any(name.endswith(".amc") for name, _ in files) else []
    given = uploads(dict(files + asf))
    asked = job_server.http.post("/v1/jobs/inspect", files=given, data={"fps": "60", "unit": "m"}, timeout=120)
    outcome = "refused"
    if asked.status_code != 422:
        job = ended(job_server, asked)
        if job["status"] == "done":
            told = result(job_server, job).json()["files"]
            job_server.http.delete(asked.headers["Location"])
            assert [file["name"] for file in told] == [name for name, _ in files]
            return Counter("refused" if file.get("problem") and not file.get("frames") else "read" for file in told)
        assert job["error"]["status"] == 422, job["error"]
        outcome = "crashed" if "crashed" in job["error"]["detail"] else "failed"
    if len(files) == 1:
        return Counter([outcome])
    return inspected(job_server, files[::2]) + inspected(job_server, files[1::2])


def survived(job_server, files: list[tuple[str, bytes]], together: int) -> Counter:
    """What becomes of files, so many at a time, while the service stays as it is."""
    before = psutil.Process(job_server.process.pid).memory_info().rss
    outcomes: Counter = Counter()
    for first in range(0, len(files), together):
        outcomes += inspected(job_server, sorted(files[first : first + together]))
        begun = time.monotonic()
        job_server.http.get("/health/live").raise_for_status()
        assert time.monotonic() - begun < 2
    assert job_server.process.poll() is None
    assert outcomes.total() == len(files)
    assert psutil.Process(job_server.process.pid).memory_info().rss - before < 60e6
    return outcomes


@pytest.mark.slow
def test_damaged_files_are_refused_or_read(job_server):
    c3d = survived(job_server, damaged({".c3d": 20}, seed=1), 10)
    text = survived(job_server, damaged({".bvh": 30, ".amc": 30}, seed=2), 60)
    assert min(c3d["refused"], text["refused"]) > 5
    assert text["crashed"] == 0


@pytest.mark.benchmark
def test_thousands_of_damaged_files_are_refused_or_read(job_server, capsys):
    begun = time.monotonic()
    c3d = survived(job_server, damaged({".c3d": 1000}, seed=3), 10)
    text = survived(job_server, damaged({".bvh": 5000, ".amc": 5000}, seed=4), 100)
    assert text["crashed"] == 0
    with capsys.disabled():
        sys.stdout.write(
            f"\n1,000 C3D: {dict(c3d)}; 10,000 BVH and AMC: {dict(text)}; {time.monotonic() - begun:.0f} s\n"
        )
