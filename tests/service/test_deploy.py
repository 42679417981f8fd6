"""The files for containers say what the service understands."""

import json
import re
import shlex
from pathlib import Path

import yaml

from service.settings import Settings

DEPLOY = Path(__file__).parents[2] / "service" / "deploy"
COMPOSE = yaml.safe_load((DEPLOY / "compose.yaml").read_text())


def filled(value: str) -> str:
    """A value with the variables of `.env`."""
    given = {"MOTIONENV_SERVICE_KEYS": json.dumps(["k" * 20])}
    return re.sub(r"\$\{(\w+)(?::[?-][^}]*)?\}", lambda found: given[found[1]], value)


def test_what_is_set_fits(monkeypatch):
    for variable, value in COMPOSE["services"]["api"]["environment"].items():
        assert variable.removeprefix("MOTIONENV_SERVICE_").lower() in Settings.model_fields
        monkeypatch.setenv(variable, filled(value))
    monkeypatch.setenv("MOTIONENV_SERVICE_HOST", "0.0.0.0")
    read = Settings()
    assert (read.workers, read.rate, [key.get_secret_value() for key in read.keys]) == (2, 600, ["k" * 20])


def test_every_variable_that_is_needed_is_in_the_example():
    needed = set(re.findall(r"\$\{(\w+):\?\}", (DEPLOY / "compose.yaml").read_text()))
    example = (DEPLOY / "env.example").read_text()
    assert {line.split("=")[0] for line in example.splitlines() if not line.startswith("#")} == needed | {"SITE"}


def test_what_runs_is_neither_root_nor_able_to_write_its_root():
    service = COMPOSE["services"]["api"]
    assert service["read_only"]
    assert service["cap_drop"] == ["ALL"]
    lines = (DEPLOY / "Containerfile").read_text().replace("\\\n", " ").splitlines()
    told = {line.split()[0]: line for line in lines if line and line[0].isupper()}
    assert told["USER"] == "USER 10001"
    made = lines.index("RUN motionenv compile")  # by the user who runs it, into what a new volume begins with
    assert lines.index(told["USER"]) < made < lines.index(told["VOLUME"])
    assert shlex.split(told["ENTRYPOINT"].split(maxsplit=1)[1].strip("[]")) == ["motionenv"]
    assert "/health/ready" in (DEPLOY / "Containerfile").read_text()
