"""A real S3 server on this machine, and a gate before it that can fail."""

import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

KEYS = {"key": "tests", "secret": "only-here", "client_kwargs": {"region_name": "us-east-1"}}


def options(port: int, **more) -> dict:
    """Options of `fsspec` for a server at a port."""
    quick = {"retries": {"max_attempts": 0}, "read_timeout": 1, "connect_timeout": 1}
    return {**KEYS, "endpoint_url": f"http://127.0.0.1:{port}", "config_kwargs": quick, **more}


@contextmanager
def s3_server() -> Iterator[int]:
    """Port of a server with an empty bucket "sets"."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        for _ in range(600):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/moto-api/", timeout=1)
                break
            except (OSError, urllib.error.URLError):
                time.sleep(0.1)
        urllib.request.urlopen(urllib.request.Request(f"http://127.0.0.1:{port}/sets", method="PUT"), timeout=20)
        yield port
    finally:
        server.terminate()
        server.wait()


class Gate(ThreadingHTTPServer):
    """Passes requests on to a server, or as `mood` says answers 500, or nothing at all for a while, to uploads."""

    daemon_threads = True

    def __init__(self, port: int):
        super().__init__(("127.0.0.1", 0), _Passing)
        self.behind, self.mood, self.refused = port, "open", 0
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def port(self) -> int:
        return self.server_address[1]


class _Passing(BaseHTTPRequestHandler):
    server: Gate
    protocol_version = "HTTP/1.1"  # clients wait for its "100 Continue"

    def log_message(self, *_) -> None:
        pass

    def _body(self) -> bytes:
        """The whole body, also of one that comes in pieces."""
        if self.headers.get("Transfer-Encoding", "") != "chunked":
            return self.rfile.read(int(self.headers.get("Content-Length", 0)))
        pieces = []
        while size := int(self.rfile.readline().split(b";")[0], 16):
            pieces.append(self.rfile.read(size))
            self.rfile.readline()
        self.rfile.readline()
        return b"".join(pieces)

    def _headers(self) -> dict[str, str]:
        """Those to pass on; without a type of content urllib would say that it is a form."""
        kept = {
            name: value for name, value in self.headers.items() if name.lower() not in ("transfer-encoding", "expect")
        }
        return {"Content-Type": "application/octet-stream", **kept}

    def _pass(self) -> None:
        body = self._body()
        if self.command == "PUT" and self.server.mood != "open":
            self.server.refused += 1
            if self.server.mood == "slow":
                time.sleep(2)
            self.send_response(500)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        url = f"http://127.0.0.1:{self.server.behind}{self.path}"
        request = urllib.request.Request(url, data=body or None, method=self.command, headers=self._headers())
        try:
            answer = urllib.request.urlopen(request, timeout=20)
        except urllib.error.HTTPError as error:
            answer = error
        content = answer.read()
        self.send_response(answer.status)
        for name, value in answer.headers.items():
            if name.lower() not in ("transfer-encoding", "connection", "content-length"):
                self.send_header(name, value)
        length = answer.headers.get("Content-Length") if self.command == "HEAD" else str(len(content))
        self.send_header("Content-Length", length or "0")
        self.end_headers()
        self.wfile.write(content)

    do_GET = do_PUT = do_POST = do_HEAD = do_DELETE = _pass
