"""What traces cost: CPU time per walk of a service without them, with the usual share of requests, and with all.

    motionenv bench service.tracing [--rounds 5] [--seconds 6]

The servers are measured in turn, with wrk's requests for JSON walks; the collector is a program that reads and forgets.
The ratio is of the CPU time of the whole server process, the thread that sends spans included.
"""

import statistics
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from benchmarks import Arguments, needs
from benchmarks.service.load import SYNTHESIS, check_wrk, load
from benchmarks.service.servers import service

JSON = "application/json"
SHARES = {"off": None, "1 in 100 (the default)": 0.01, "all": 1.0}


def main() -> None:
    """Print the table."""
    options = Arguments(__doc__)
    options.add_argument("--rounds", type=int, default=5, quick=1)
    options.add_argument("--seconds", type=int, default=6, quick=1, help="for each measurement")
    asked = options.parse_args()
    check_wrk()
    needs("opentelemetry")
    with tempfile.TemporaryDirectory(prefix="motionenv-bench-") as folder, _collector() as address:
        cpu: dict[str, list[float]] = {name: [] for name in SHARES}
        for turn in range(asked.rounds):
            for name, share in SHARES.items():
                told = {} if share is None else {"traces": address, "trace_share": share}
                with service(Path(folder, "data"), **told) as served:
                    load(served, SYNTHESIS, JSON, min(2, asked.seconds))
                    cpu[name].append(load(served, SYNTHESIS, JSON, asked.seconds, first=turn * 1_000_000).cpu)
    print("| traces | µs CPU per walk | more than without |\n|-|-|-|")
    for name, spent in cpu.items():
        more = statistics.median(a / b - 1 for a, b in zip(spent, cpu["off"], strict=True))
        print(f"| {name} | {statistics.median(spent):.0f} | {more:+.1%} |")


@contextmanager
def _collector() -> Iterator[str]:
    """The address of a collector that forgets."""

    class Forgetting(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Forgetting)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/v1/traces"
    finally:
        server.shutdown()


if __name__ == "__main__":
    main()
