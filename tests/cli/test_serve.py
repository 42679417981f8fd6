"""`motionenv serve`: flags reach the service, and what it can't be started with is told."""

import re
import signal
import subprocess
import sys

import httpx
import pytest

from tests.cli.talking import ENVIRONMENT, in_a_process


def test_the_service_runs_with_the_flags_until_it_is_told_to_end(tmp_path):
    command = [sys.executable, "-m", "motionenv", "serve", "--port", "0", "--data", "mine", "--max-json", "1000"]
    with subprocess.Popen(command, cwd=tmp_path, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True) as process:
        line = next(line for line in process.stderr if "running on" in line)
        url = re.search(r"http://[^\s\"]+", line)[0]
        assert httpx.get(f"{url}/health/ready").json() == {"status": "ready"}
        assert httpx.post(f"{url}/v1/synthesis", json={"model": "x" * 1000}).status_code == 413
        process.send_signal(signal.SIGTERM)
        process.stderr.read()
    assert process.returncode in (0, -signal.SIGTERM)
    assert (tmp_path / "mine" / "jobs.sqlite").exists()


@pytest.mark.parametrize(
    ("flags", "says"),
    [
        (["--port", "70000"], "--port: Input should be less than or equal to 65535, got '70000'"),
        (["--max-json", "0"], "--max-json: Input should be greater than or equal to 1, got '0'"),
        (["--host", "0.0.0.0"], "host '0.0.0.0' is reachable from other machines, but there are no keys: set keys"),
        (["--keys", '["hidden"]'], "each key must have at least 16 characters"),
        (["--nonsense", "3"], "unrecognized arguments: --nonsense 3"),
    ],
)
def test_settings_that_can_not_be_are_told_and_nothing_starts(tmp_path, flags, says):
    done = in_a_process("serve", "--data", tmp_path / "data", *flags)
    assert (done.returncode, done.stdout) == (2, "")
    assert "motionenv serve: " in done.stderr
    assert says in done.stderr
    assert "hidden" not in done.stderr
    assert not (tmp_path / "data").exists()
