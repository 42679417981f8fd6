"""What the service logs is one JSON object a line, whoever logs it."""

import json
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[2]
LOGGING = """
import logging, pathlib, warnings, structlog
from service.observability import logs

logs.configure()
structlog.get_logger("motionenv.service").info("job done", job="a", seconds=1.5, where=pathlib.Path("x"), by={1: "é"})
logging.getLogger("uvicorn.error").warning("running on %s", "http://127.0.0.1:1")
logging.getLogger("library").debug("not worth a line")
warnings.warn("beyond what was learned")
try:
    1 / 0
except ZeroDivisionError:
    structlog.get_logger().exception("job failed")
    logging.getLogger("library").exception("it broke\\nin two lines")
"""


def test_every_line_is_json_with_level_and_time():
    begun = datetime.now(UTC)
    done = subprocess.run([sys.executable, "-c", LOGGING], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == ""
    lines = [json.loads(line) for line in done.stderr.splitlines()]
    warned = lines.pop(2)
    assert (warned["level"], "UserWarning: beyond what was learned" in warned["event"]) == ("warning", True)
    assert [(line["event"], line["level"]) for line in lines] == [
        ("job done", "info"), ("running on http://127.0.0.1:1", "warning"), ("job failed", "error"),
        ("it broke\nin two lines", "error"),
    ]  # fmt: skip
    for line in lines:
        assert line["timestamp"].endswith("Z")
        assert begun <= datetime.fromisoformat(line["timestamp"]) <= datetime.now(UTC)
    assert (lines[0]["job"], lines[0]["seconds"], lines[0]["by"]) == ("a", 1.5, {"1": "é"})
    assert lines[0]["where"] == repr(Path("x"))
    assert all("ZeroDivisionError: division by zero" in line["exception"] for line in lines[2:])
