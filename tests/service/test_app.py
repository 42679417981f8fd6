"""The application as a whole: what it documents it serves, and nothing else."""

import re

import httpx
import pytest

from service.app import create_app
from service.settings import Settings
from tests.service.inside import answers

#: The page, the documents, and a WebSocket.
UNDOCUMENTED = {"/", "/assets", "/docs", "/openapi.json", "/v1/stream"}


def test_every_route_is_in_the_document(tmp_path):
    app = create_app(Settings(data=tmp_path))
    documented = {(path, method.upper()) for path, told in app.openapi()["paths"].items() for method in told}
    paths = app.state.paths
    assert paths.keys() - {path for path, _ in documented} == UNDOCUMENTED
    assert {(path, m) for path in paths.keys() - UNDOCUMENTED for m in paths[path] - {"HEAD"}} == documented


def test_operations_are_named_once(tmp_path):
    told = create_app(Settings(data=tmp_path)).openapi()["paths"]
    ids = [operation["operationId"] for operations in told.values() for operation in operations.values()]
    assert len(set(ids)) == len(ids)
    assert all(operation["summary"] for operations in told.values() for operation in operations.values())


def test_every_schema_that_is_named_is_there(tmp_path):
    app = create_app(Settings(data=tmp_path))
    text = httpx.Response(200, json=app.openapi()).text
    named = set(re.findall(r'"#/components/schemas/([^"]+)"', text))
    assert "ProblemDetail" in named
    assert named <= set(app.openapi()["components"]["schemas"])


def test_settings_come_from_the_environment_where_none_are_given(monkeypatch, tmp_path):
    monkeypatch.setenv("MOTIONENV_SERVICE_DATA", str(tmp_path / "mine"))
    monkeypatch.setenv("MOTIONENV_SERVICE_STREAMS", "3")
    service = create_app().state.service
    assert (service.settings.data, service.settings.streams) == (tmp_path / "mine", 3)
    assert service.model_registry.folder == tmp_path / "mine" / "models"
    assert not service.ready


@pytest.mark.parametrize("path", ["/v1/models/", "/docs/", "/redoc", "/openapi.json/", "/v1/stream"])
def test_other_spellings_are_not_found_and_lead_nowhere(tmp_path, path):
    (answer,) = answers(tmp_path, [("GET", path, {})])
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"


def test_pages_of_other_sites_are_told_what_they_may_read(tmp_path):
    lab = {"Origin": "https://lab.example"}
    preflight = lab | {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "Content-Type"}
    asked = [("GET", "/v1/models", {"headers": lab}), ("OPTIONS", "/v1/synthesis", {"headers": preflight}),
             ("GET", "/v1/models", {"headers": {"Origin": "https://evil.example"}})]  # fmt: skip
    mine, before, evil = answers(tmp_path / "a", asked, cors=("https://lab.example",))
    assert mine.headers["access-control-allow-origin"] == "https://lab.example"
    exposed = set(mine.headers["access-control-expose-headers"].split(", "))
    assert exposed == {"ETag", "Location", "Motion-Seed", "Motion-Warning", "RateLimit", "RateLimit-Policy",
                       "Retry-After", "X-Request-ID"}  # fmt: skip
    assert (before.status_code, before.headers["access-control-allow-origin"]) == (200, "https://lab.example")
    assert "access-control-allow-origin" not in evil.headers
    (closed,) = answers(tmp_path / "b", asked[:1])
    assert "access-control-allow-origin" not in closed.headers
