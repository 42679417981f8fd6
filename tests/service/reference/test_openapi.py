"""The OpenAPI document tells formats, problems and keys."""


def test_the_openapi_says_what_wants_a_key(locked, server):
    told = locked.http.get("/openapi.json").json()
    assert set(told["components"]["securitySchemes"]) == {"bearer", "header", "basic"}
    assert told["paths"]["/v1/synthesis"]["post"]["security"]
    assert "security" not in told["paths"]["/health/live"]["get"]
    assert "securitySchemes" not in server.http.get("/openapi.json").json()["components"]


FILES = {"application/x-npz": ".npz", "text/csv": ".csv", "model/x-bvh": ".bvh", "model/gltf-binary": ".glb",
         "application/x-c3d": ".c3d", "text/x-trc": ".trc", "text/x-mot": ".mot"}  # fmt: skip


def test_the_document_tells_every_format_and_problem(server):
    told = server.http.get("/openapi.json").json()["paths"]["/v1/synthesis"]["post"]["responses"]
    assert {*FILES, "application/json", "application/x-npy", "video/mp4", "image/png"} <= set(told["200"]["content"])
    assert {"304", "400", "401", "404", "406", "413", "422", "429", "501", "503", "504"} <= set(told)
    assert told["200"]["content"]["application/json"]["schema"]["$ref"].endswith("MotionResponse")
