"""Models by name: ready-made, fitted, changed on disk, and missing."""

import motionenv


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
