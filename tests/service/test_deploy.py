"""The files for containers say what the service understands."""

import json
import re
import shlex
from pathlib import Path

import pytest
import yaml

from service.cluster.worker import WorkerSettings
from service.settings import Settings

DEPLOY = Path(__file__).parents[2] / "service" / "deploy"
COMPOSE = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
SECRETS = {name: "s" * 20 for name in ("POSTGRES_PASSWORD", "OBJECTS_PASSWORD")}


def filled(value: str) -> str:
    """A value with the variables of `.env`."""
    given = SECRETS | {"MOTIONENV_SERVICE_KEYS": json.dumps(["k" * 20])}
    return re.sub(r"\$\{(\w+)(?::[?-][^}]*)?\}", lambda found: given[found[1]], value)


@pytest.mark.parametrize(("name", "settings"), [("api", Settings), ("worker", WorkerSettings)])
def test_what_is_set_fits(name, settings, monkeypatch):
    environment = COMPOSE["services"][name]["environment"]
    assert environment["AWS_ENDPOINT_URL"].startswith("http://objects:")
    for variable, value in environment.items():
        if variable.startswith("MOTIONENV_SERVICE_"):
            assert variable.removeprefix("MOTIONENV_SERVICE_").lower() in settings.model_fields
            monkeypatch.setenv(variable, filled(value))
    monkeypatch.setenv("MOTIONENV_SERVICE_HOST", "0.0.0.0")
    read = settings()
    assert read.store == "s3://motionenv"
    assert read.database.get_secret_value() == f"postgresql://motionenv:{'s' * 20}@database/motionenv"


def test_every_variable_that_is_needed_is_in_the_example():
    needed = set(re.findall(r"\$\{(\w+):\?\}", (DEPLOY / "compose.yaml").read_text()))
    example = (DEPLOY / "env.example").read_text()
    assert {line.split("=")[0] for line in example.splitlines() if not line.startswith("#")} == needed | {"SITE"}


def test_what_runs_is_neither_root_nor_able_to_write_its_root():
    for name in ("api", "worker"):
        service = COMPOSE["services"][name]
        assert service["read_only"]
        assert service["cap_drop"] == ["ALL"]
        assert service.get("command", ["serve"]) in (["serve"], ["work"])
    lines = (DEPLOY / "Containerfile").read_text().replace("\\\n", " ").splitlines()
    told = {line.split()[0]: line for line in lines if line and line[0].isupper()}
    assert told["USER"] == "USER 10001"
    made = lines.index("RUN motionenv compile")  # by the user who runs it, into what a new volume begins with
    assert lines.index(told["USER"]) < made < lines.index(told["VOLUME"])
    assert shlex.split(told["ENTRYPOINT"].split(maxsplit=1)[1].strip("[]")) == ["motionenv"]
    assert "/health/ready" in (DEPLOY / "Containerfile").read_text()
