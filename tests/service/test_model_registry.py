"""Models by name: ready-made, fitted, changed on disk, and missing."""

import os

import pytest

import motionenv
from motionenv.models import names
from service.errors import Problem
from service.model_registry import ModelRegistry
from service.transport.access import EVERYTHING


def test_a_fitted_model_is_served(server):
    path = server.data / "models" / "mine.npz"
    motionenv.load("walk/fpca").save(path, {"data": "ours", "model licence": "CC0"})
    told = server.http.get("/v1/models/fitted/mine").json()
    assert (told["kind"], told["licence"], told["summary"]) == ("walking", "CC0", "ours")
    assert "fitted/mine" in [model["name"] for model in server.http.get("/v1/models").json()["models"]]
    asked = {"model": "fitted/mine", "seed": 1, "seconds": 0.5}
    first = server.http.post("/v1/synthesis", json=asked)
    shipped = server.http.post("/v1/synthesis", json=asked | {"model": "walk/fpca"})
    assert first.json()["poses"] == shipped.json()["poses"]
    motionenv.load("walk/eigenwalkers").save(path)
    second = server.http.post("/v1/synthesis", json=asked)
    assert second.headers["etag"] != first.headers["etag"]
    assert second.json()["poses"] != first.json()["poses"]
    path.unlink()
    assert server.http.post("/v1/synthesis", json=asked).status_code == 404


@pytest.fixture
def registry(tmp_path) -> ModelRegistry:
    return ModelRegistry(tmp_path)


@pytest.mark.parametrize("name", ["walk/fpac", "fitted/nobody", "fitted/../x", "fitted/A", "fitted/a/b", "x", ""])
def test_a_model_that_there_is_not_is_404(registry, name):
    for asked in (registry.get, registry.find):
        with pytest.raises(Problem, match=f"there is no model {name!r}: GET /v1/models lists them") as missing:
            asked(name, EVERYTHING)
        assert missing.value.status_code == 404
        assert missing.value.errors[0]["field"] == "/model"
    if name == "walk/fpac":
        assert "walk/fpca" in missing.value.detail


def test_a_model_that_is_still_to_come_is_503_with_a_time(registry):
    assert registry.find("mixed/tree", EVERYTHING) == (None, None)
    with pytest.raises(Problem, match="mixed/tree is still being loaded") as waiting:
        registry.get("mixed/tree", EVERYTHING)
    assert (waiting.value.status_code, waiting.value.headers["Retry-After"]) == (503, "5")


def test_a_damaged_file_is_told_and_hides_no_other(registry, tmp_path):
    motionenv.load("walk/fpca").save(tmp_path / "good.npz")
    (tmp_path / "bad.npz").write_bytes((tmp_path / "good.npz").read_bytes()[:500])
    model, problem = registry.find("fitted/bad", EVERYTHING)
    assert model is None
    assert "bad.npz" in problem
    with pytest.raises(Problem, match="fitted/bad can't be used here") as refused:
        registry.get("fitted/bad", EVERYTHING)
    assert refused.value.status_code == 503
    assert registry.get("fitted/good", EVERYTHING).kind == "walking"
    assert registry.names(EVERYTHING) == [*names(), "fitted/bad", "fitted/good"]


def test_a_file_that_changes_is_read_again_and_has_another_version(registry, tmp_path):
    path = tmp_path / "mine.npz"
    motionenv.load("walk/fpca").save(path)
    first, version = registry.get("fitted/mine", EVERYTHING), registry.version("fitted/mine")
    assert registry.get("fitted/mine", EVERYTHING) is first
    motionenv.load("walk/eigenwalkers").save(path)
    os.utime(path, ns=(0, path.stat().st_mtime_ns + 1_000_000))
    assert registry.get("fitted/mine", EVERYTHING).kind == "eigenwalkers"
    assert registry.version("fitted/mine") != version
    assert registry.version("walk/fpca") == registry.version("walk/fpca")
