"""`/docs` draws every operation, without a request to another server; the OpenAPI document names formats and keys."""

import re

import pytest

from service.errors import KINDS
from tests.service.page.browsing import DESK, PHONE, tab

FILES = {"application/x-npz", "text/csv", "model/x-bvh", "model/gltf-binary", "application/x-c3d", "text/x-trc",
         "text/x-mot"}  # fmt: skip


def test_the_reference_is_drawn_and_tries_calls_without_leaving_the_server(browser, server):
    told = server.http.get("/openapi.json").json()
    seen, asked = tab(browser, server.url), []
    seen.page.on("request", lambda request: asked.append(request.url))
    policy = seen.page.goto(f"{server.url}/docs").headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; script-src 'self' 'sha256-")
    operations = {f"{method.upper()} {path}" for path, methods in told["paths"].items() for method in methods}
    seen.until(f"document.querySelectorAll('.opblock').length >= {len(operations)}", 60)  # some have two tags
    parts = (seen.page.locator(f".opblock-summary-{part}").all_text_contents() for part in ("method", "path"))
    assert {f"{method} {path}".replace("\u200b", "") for method, path in zip(*parts, strict=True)} == operations
    text = seen.page.locator(".info").inner_text()
    assert all(kind in text for kind in KINDS)
    block = seen.page.locator("[id$=describe_body]")
    block.locator(".opblock-summary-control").click()
    block.locator(".try-out__btn").click()
    block.locator(".execute").click()
    block.locator(".live-responses-table .response-col_status").first.wait_for()
    seen.until("document.body.innerText.includes('left_knee_flexion')")
    assert f"{server.url}/v1/body" in asked
    assert all(url.startswith((server.url, "data:", "blob:")) for url in asked)
    assert seen.complaints == []


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
def test_contents_lead_to_every_operation_on_any_screen(browser, server, size):
    told = server.http.get("/openapi.json").json()
    operations = sum(map(len, told["paths"].values()))
    seen = tab(browser, server.url, size)
    seen.page.goto(f"{server.url}/docs")
    seen.until(f"document.querySelectorAll('.contents ul ul li').length >= {operations}", 60)
    if size == PHONE:
        seen.page.click(".contents summary")
    seen.page.click(".contents a[title='/v1/body']")
    assert seen.page.locator("[id$=describe_body].is-open").count() == 1
    seen.until("document.querySelector('[id$=describe_body]').getBoundingClientRect().top < innerHeight / 2")
    assert seen.ask("document.documentElement.scrollWidth") <= size[0]
    seen.picture(f"docs-{size[0]}")
    assert seen.complaints == []


def test_the_document_names_every_format_and_problem(server):
    operations = server.http.get("/openapi.json").json()["paths"]["/v1/synthesis"]
    assert {"206", "304", "416"} <= set(operations["get"]["responses"])
    told = operations["post"]["responses"]
    assert {*FILES, "application/json", "application/x-npy", "video/mp4", "image/png"} <= set(told["200"]["content"])
    assert {"400", "401", "404", "406", "412", "413", "422", "429", "503", "504"} <= set(told)
    assert told["200"]["content"]["application/json"]["schema"]["$ref"].endswith("MotionResponse")


def test_the_document_says_what_needs_a_key(locked, server):
    told = locked.http.get("/openapi.json").json()
    assert set(told["components"]["securitySchemes"]) == {"bearer", "header", "basic"}
    assert told["paths"]["/v1/synthesis"]["post"]["security"]
    assert "security" not in told["paths"]["/health/live"]["get"]
    assert "securitySchemes" not in server.http.get("/openapi.json").json()["components"]
    verbs = {operation["operationId"].partition("_")[0] for one in told["paths"].values() for operation in one.values()}
    known = "analyse cancel check convert describe fit get inspect lift list make remove render report sample"
    assert verbs <= {*known.split(), "synthesize", "upload", "walk"}


def test_there_is_one_reference_and_it_is_no_cdns(server):
    assert server.http.get("/redoc").status_code == 404
    page = server.http.get("/docs").text
    loaded = re.findall(r'(?:src|href)="([^"]+)"', page)
    assert len(loaded) == 5
    assert all(server.http.get(f"/{address}").status_code == 200 for address in loaded)
