"""A real PostgreSQL server on this machine, which an ordinary user runs."""

import os
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg
import pytest


def _programs() -> Path | None:
    """Debian keeps the server's programs off the PATH."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb")) + [
        Path(path) for path in [shutil.which("initdb")] if path
    ]
    return found[-1].parent if found else None


class Postgres:
    """A server at a port of this machine; it can be stopped in any way and started again."""

    def __init__(self, folder: Path):
        programs = _programs()
        if programs is None:
            if os.environ.get("MOTIONENV_REQUIRE_POSTGRES"):
                raise AssertionError("install Debian's package postgresql")
            pytest.skip("no PostgreSQL: install Debian's package postgresql")
        self.programs, self.folder = programs, folder / "postgres"
        self.folder.mkdir()
        self.as_user = {}
        if os.getuid() == 0:  # the server refuses to be run by root
            self.as_user = {"user": "nobody", "group": pwd.getpwnam("nobody").pw_gid, "extra_groups": []}
            shutil.chown(self.folder, "nobody")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        subprocess.run(
            [programs / "initdb", "-D", self.folder / "data", "-U", "tests", "-A", "trust", "-E", "UTF8", "--no-sync"],
            check=True, capture_output=True, cwd=self.folder, **self.as_user,
        )  # fmt: skip
        self.start()

    def start(self) -> None:
        """Start the server, and wait until it answers."""
        with (self.folder.parent / "postgres.log").open("ab") as log:
            self.process = subprocess.Popen(
                [self.programs / "postgres", "-D", self.folder / "data", "-p", str(self.port), "-k", "",
                 "-c", "listen_addresses=127.0.0.1", "-c", "max_connections=200",
                 "-c", "fsync=off"],  # no test cuts the power; a busy disk makes recovery take longer than one waits
                stderr=log, cwd=self.folder, start_new_session=True, **self.as_user,
            )  # fmt: skip
        until = time.monotonic() + 60
        while True:
            try:
                psycopg.connect(self.url("postgres"), connect_timeout=2).close()
                return
            except psycopg.OperationalError:
                assert time.monotonic() < until, (self.folder.parent / "postgres.log").read_text()
                time.sleep(0.05)

    def stop(self, how: signal.Signals = signal.SIGINT) -> None:
        """Stop the server: SIGINT cuts all connections, SIGQUIT and SIGKILL do so without tidying up."""
        self.process.send_signal(how)
        assert self.process.wait(60) is not None

    def restart(self, how: signal.Signals = signal.SIGINT) -> None:
        """Stop and start."""
        self.stop(how)
        self.start()

    def url(self, database: str) -> str:
        """Where a database is."""
        return f"postgresql://tests@127.0.0.1:{self.port}/{database}"

    def new(self) -> str:
        """The address of a new, empty database."""
        name = f"t{secrets.token_hex(6)}"
        with psycopg.connect(self.url("postgres"), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return self.url(name)


@contextmanager
def postgres_server() -> Iterator[Postgres]:
    """A server with its files in a folder of its own.

    It isn't below pytest's, which pytest closes to other users whenever another run begins: the server runs as one.
    """
    with tempfile.TemporaryDirectory(prefix="motionenv-postgres-") as folder:
        Path(folder).chmod(0o755)
        server = Postgres(Path(folder))
        try:
            yield server
        finally:
            server.stop()
