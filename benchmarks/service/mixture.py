"""Memory of the service under a mixture of everything: walks, films, stimuli, streams, lifts, tree motion.

    motionenv bench service.mixture [--minutes 12]

Each kind of request has a client of its own that pauses after each answer; no two requests have the same seed. Every
ten seconds the resident memory of all processes of the service is read. "Growth" compares the median of the last
quarter with that of the second one, when all caches are filled.
"""

import json
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import httpx
from websockets.sync.client import connect

import motionenv
from benchmarks import Arguments
from benchmarks.service.servers import KEY, Served, machine, service
from motionenv.lifting import project_markers
from service.formats import dumps

_WAIT = 120.0  # [s] for an answer
_STREAMED = 300  # frames of a stream


@dataclass
class Client:
    """What one client asks for: `ask(seed)` returns a status, and is called again after `pause` [s]."""

    name: str
    ask: Callable[[int], int]
    pause: float
    statuses: list[int] = field(default_factory=list)

    def run(self, seeds: Iterator[int], stop: threading.Event) -> None:
        """Ask until `stop`."""
        while not stop.wait(self.pause):
            self.statuses.append(self.ask(next(seeds)))


def clients(server: Served) -> list[Client]:
    """The mixture."""
    http = httpx.Client(base_url=server.url, timeout=_WAIT, headers={"Authorization": f"Bearer {KEY}"})
    walk = motionenv.synthesize("walk/eigenwalkers", 3.0, 30, seed=5)
    seen = project_markers(
        motionenv.Markers(motionenv.types.MARKERS, motionenv.markers(walk.poses, walk.skeleton), 30), 0.7
    )

    def post(path: str, body: dict, accept: str = "application/json") -> int:
        sent = {"Content-Type": "application/json", "Accept": accept}
        return http.post(path, content=dumps(body), headers=sent).status_code

    def walked(seed: int) -> int:
        model, accept = (
            ("walk/fpca", "walk/eigenwalkers")[seed % 2],
            ("application/json", "application/x-npz")[seed % 3 % 2],
        )
        return post("/v1/synthesis", {"seed": seed, "model": model, "seconds": 1 + seed % 20}, accept)

    def filmed(seed: int) -> int:
        picture = {"width": 320, "height": 240, "view": seed % 360}
        return post("/v1/synthesis", {"seed": seed, "seconds": 2 + seed % 5, "picture": picture}, "video/mp4")

    def stimulated(seed: int) -> int:
        people = [{"model": "walk/fpca", "deviations": [seed % 5 - 2.0]}]
        display = {"mask": seed % 40, "seed": seed}
        return post("/v1/stimuli", {"people": people, "displays": [display], "seconds": 1}, "application/zip")

    def lifted(seed: int) -> int:
        points = (seen.positions + 1e-6 * (seed % 1000)).tolist()
        return post("/v1/lift", {"points": points, "fps": seen.fps, "unit": seen.unit})

    return [
        Client("walks, JSON and NPZ", walked, 0.1),
        Client("strides", lambda seed: post("/v1/cycles", {"seed": seed}), 0.3),
        Client("tree samples", lambda seed: post("/v1/tree/samples", {"seed": seed, "n": 100, "start": "walk"}), 0.3),
        Client(
            "tree motion", lambda seed: post("/v1/tree/synthesis", {"seed": seed, "seconds": 5, "start": "walk"}), 2.0
        ),
        Client("films, MP4", filmed, 2.0),
        Client("stimuli, ZIP", stimulated, 5.0),
        Client("lifts", lifted, 3.0),
        Client("streams", lambda seed: _streamed(server, seed), 1.0),
    ]


def _streamed(server: Served, seed: int) -> int:
    """Read a stream of a model or of the tree for some seconds."""
    model = ("walk/fpca", "mixed/tree")[seed % 2]
    address = f"{server.url.replace('http', 'ws')}/v1/stream"
    with connect(address, additional_headers={"Authorization": f"Bearer {KEY}"}, open_timeout=_WAIT) as socket:
        socket.send(json.dumps({"model": model, "seed": seed}))
        frames = 0
        while frames < _STREAMED:
            frames += isinstance(socket.recv(timeout=_WAIT), bytes)
    return 200


def main() -> None:
    """Run the mixture and print memory over time."""
    options = Arguments(__doc__)
    options.add_argument("--minutes", type=float, default=12.0, quick=0.1)
    options.add_argument("--every", type=float, default=10.0, quick=1.0, help="seconds between samples")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="motionenv-bench-") as folder, service(Path(folder)) as server:
        asking, seeds, stop = clients(server), count(1), threading.Event()
        threads = [threading.Thread(target=client.run, args=(seeds, stop)) for client in asking]
        spent, (busy, all_) = server.cpu(), machine()
        for thread in threads:
            thread.start()
        begun, memory = time.monotonic(), [server.memory()]
        while time.monotonic() - begun < 60 * asked.minutes:
            time.sleep(asked.every)
            memory.append(server.memory())
        stop.set()
        for thread in threads:
            thread.join()
        spent, (busy_after, all_after) = server.cpu() - spent, machine()
    _tell(asking, memory, asked.minutes)
    used = (busy_after - busy) / (all_after - all_)
    print(f"The service used {spent / (60 * asked.minutes):.0%} of a core; both cores were used by {used:.0%}.")


def _tell(asking: list[Client], memory: list[float], minutes: float) -> None:
    """Print the answers of each client, and `memory` [MB] over time."""
    print("| client | answers | not 200 |\n|-|-|-|")
    for client in asking:
        print(f"| {client.name} | {len(client.statuses):,} | {sum(status != 200 for status in client.statuses)} |")
    size = len(memory) // 4
    quarters = [statistics.median(memory[i * size : (i + 1) * size]) for i in range(4)]
    told = ", ".join(f"{quarter:.0f}" for quarter in quarters)
    print(
        f"\nMemory over {minutes:g} minutes, {len(memory)} samples: {memory[0]:.0f} MB at the start, by quarters of "
        f"the time {told} MB, at most {max(memory):.0f} MB. Growth {quarters[3] / quarters[1] - 1:+.1%}."
    )


if __name__ == "__main__":
    main()
