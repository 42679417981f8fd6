"""The service under load on loopback: `motionenv serve` with a key, metrics and log, compared with bare endpoints.

    motionenv bench service [--rounds 3] [--seconds 8]

wrk sends requests over 16 connections, each with another seed; it uses the second of two cores. Each round measures
all servers in turn, so that ratios compare the same minute; results are medians over rounds. The microseconds of CPU
per request, over all processes of the server, and their ratios are valid on a busy machine, too. The last column is the
share of the machine used by other jobs: repeat the run if it isn't near 0.
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks import Arguments, headline
from benchmarks.service.load import SAMPLES, SYNTHESIS, Load, check_wrk, load, median
from benchmarks.service.servers import Served, running, service

JSON, NPZ, NPY = "application/json", "application/x-npz", "application/x-npy"


def main() -> None:
    """Print all tables."""
    options = Arguments(__doc__)
    options.add_argument("--rounds", type=int, default=3, quick=1)
    options.add_argument("--seconds", type=int, default=8, quick=1, help="for each measurement")
    options.add_argument("--requests", type=int, default=100_000, quick=100, help="of the memory test")
    asked = options.parse_args()
    check_wrk()
    with tempfile.TemporaryDirectory(prefix="motionenv-bench-") as folder:
        started = [_start(Path(folder, "data")) for _ in range(2 if asked.quick else 3)]
        with service(Path(folder, "data")) as one:
            loads = _loads(one, asked.rounds, asked.seconds)
            film = [_film(one) for _ in range(1 if asked.quick else 5)]
        with service(Path(folder, "two"), workers=2) as two, service(Path(folder, "data")) as one:
            scaled = _scaled(one, two, asked.rounds, asked.seconds)
        with service(Path(folder, "data")) as one:
            memory = _memory(one, asked.requests)
    _tell(loads, scaled, film, started, memory)
    ours, bare = loads["synthesis, JSON"].per_second, loads["Starlette: the same work, JSON"].per_second
    headline(requests=ours, ratio=ours / bare)


def _start(data: Path) -> float:
    with service(data) as served:
        return served.seconds


@contextmanager
def _bare(what: str) -> Iterator[Served]:
    command = [sys.executable, "-m", "benchmarks.service.bare", what]
    with running(command, {}, "/health/ready") as served:
        yield served


def _loads(server: Served, rounds: int, seconds: int) -> dict[str, Load]:
    """Measure all kinds of requests to one worker, and to bare endpoints."""
    _await_tree(server)
    found: dict[str, list[Load]] = {}
    with _bare(JSON) as json, _bare(NPZ) as npz, _bare("product") as product:
        asked = [
            ("synthesis, JSON", server, SYNTHESIS, JSON, None),
            ("Starlette: the same work, JSON", json, SYNTHESIS, JSON, "/work"),
            ("Starlette: precomputed bytes, JSON", json, SYNTHESIS, JSON, "/bytes"),
            ("FastAPI: a matrix product, JSON", product, SYNTHESIS, JSON, "/product"),
            ("synthesis, NPZ", server, SYNTHESIS, NPZ, None),
            ("Starlette: the same work, NPZ", npz, SYNTHESIS, NPZ, "/work"),
            ("synthesis, NPY", server, SYNTHESIS, NPY, None),
            ("300 tree samples, JSON", server, SAMPLES, JSON, None),
        ]
        for _, *how, path in asked if rounds > 1 else ():
            load(*how, 1, path=path)  # warm
        for turn in range(rounds):
            for name, *how, path in asked:
                found.setdefault(name, []).append(load(*how, seconds, path=path, first=turn * 1_000_000))
    return {name: median(loads) for name, loads in found.items()}


def _scaled(one: Served, two: Served, rounds: int, seconds: int) -> list[tuple[Load, Load]]:
    """Measure one worker and two workers in turn."""
    for server in (one, two):
        _await_tree(server)
        load(server, SYNTHESIS, JSON, 1)
    return [(load(one, SYNTHESIS, JSON, seconds), load(two, SYNTHESIS, JSON, seconds)) for _ in range(rounds)]


def _await_tree(server: Served) -> None:
    """Wait until every worker has built the tree, which would disturb measurements."""
    with server.client() as client:
        answers = 0
        while answers < 20:
            ready = client.post(SAMPLES[0], json={"start": "walk"}, headers={"Connection": "close"}).status_code == 200
            answers = answers + 1 if ready else 0
            if not ready:
                time.sleep(1)


def _film(server: Served) -> tuple[float, float]:
    """Seconds to the first and to the last byte of a four-second MP4 of 320×240."""
    body = {"seed": 1, "seconds": 4, "fps": 30, "picture": {"width": 320, "height": 240}}
    with server.client() as client:
        begun = time.perf_counter()
        with client.stream("POST", "/v1/synthesis", json=body, headers={"Accept": "video/mp4"}) as answer:
            chunks = answer.iter_raw()
            next(chunks)
            first = time.perf_counter() - begun
            for _ in chunks:
                pass
        return first, time.perf_counter() - begun


def _memory(server: Served, most: int) -> list[tuple[int, float]]:
    """Resident memory [MB] after numbers of requests: walks as JSON and NPZ, and tree samples."""
    _await_tree(server)
    count, told = 0, []
    marks = [most // 20, most // 10, most // 2, most]
    while marks:
        for what, accept in ((SYNTHESIS, JSON), (SYNTHESIS, NPZ), (SAMPLES, JSON)):
            count += load(server, what, accept, 1 if most < 1000 else 2, first=count).count
        if count >= marks[0]:
            told.append((count, server.memory()))
            marks = [mark for mark in marks if mark > count]
    return told


def _tell(
    loads: dict[str, Load],
    scaled: list[tuple[Load, Load]],
    film: list[tuple[float, float]],
    started: list[float],
    memory: list[tuple[int, float]],
) -> None:
    """Print the measurements and the goals."""
    print("| 16 connections, one worker | requests/s | p50 ms | p99 ms | µs CPU | not 200 | CPU of other jobs |")
    print("|-|-|-|-|-|-|-|")
    for name, one in loads.items():
        print(f"| {name} | {one.per_second:,.0f} | {one.p50:.1f} | {one.p99:.1f} | {one.cpu:,.0f} | {one.wrong:,} of "
              f"{one.count:,} | {one.others:.0%} |")  # fmt: skip
    json, npz, npy, tree = (
        loads[name] for name in ("synthesis, JSON", "synthesis, NPZ", "synthesis, NPY", "300 tree samples, JSON")
    )
    work, ready = loads["Starlette: the same work, JSON"], loads["Starlette: precomputed bytes, JSON"]
    product = loads["FastAPI: a matrix product, JSON"]
    faster = statistics.median(two.per_second / one.per_second for one, two in scaled)
    dearer = statistics.median(two.cpu / one.cpu for one, two in scaled)
    growth = memory[-1][1] / memory[0][1] - 1
    rows = [
        ("synthesis, JSON", "≥ 2,500/s", f"{json.per_second:,.0f}/s"),
        ("… p99", "≤ 15 ms", f"{json.p99:.1f} ms"),
        ("… CPU per request", "≤ 400 µs", f"{json.cpu:.0f} µs"),
        ("… against Starlette, the same work", "≥ 0.75×",
         f"{json.per_second / work.per_second:.2f}× (CPU {work.cpu / json.cpu:.2f}×)"),
        ("… against Starlette, precomputed bytes", "none",
         f"{json.per_second / ready.per_second:.2f}× (CPU {ready.cpu / json.cpu:.2f}×)"),
        ("… against FastAPI, a matrix product", "none",
         f"{json.per_second / product.per_second:.2f}× (CPU {product.cpu / json.cpu:.2f}×)"),
        ("synthesis, NPZ / NPY", "≥ 3,000/s", f"{npz.per_second:,.0f} / {npy.per_second:,.0f}/s"),
        ("300 tree samples, JSON", "≥ 1,000/s", f"{tree.per_second:,.0f}/s"),
        ("… p99", "≤ 30 ms", f"{tree.p99:.1f} ms"),
        ("… CPU per request", "≤ 1,000 µs", f"{tree.cpu:,.0f} µs"),
        ("two workers", "≥ 1.7× one", f"{faster:.2f}× (CPU per request {dearer:.2f}×)"),
        ("video 4 s, 320×240 MP4, first byte", "< 0.3 s", f"{statistics.median(f for f, _ in film):.2f} s"),
        ("… whole", "< 1.5 s", f"{statistics.median(w for _, w in film):.2f} s"),
        ("start to ready, warm", "< 3 s", f"{min(started[1:]):.2f} s (first {started[0]:.2f} s)"),
        (f"memory over {memory[-1][0]:,} requests, walks as JSON and NPZ and tree samples", "± 10 %",
         f"{growth:+.1%}: " + ", ".join(f"{mb:.0f} MB after {count:,}" for count, mb in memory)),
    ]  # fmt: skip
    print("\n| | goal | measured |\n|-|-|-|")
    for row in rows:
        print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
