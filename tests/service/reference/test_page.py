"""`/docs` tells everything that the OpenAPI does, lets calls be tried, and loads nothing from elsewhere."""

import re
from html import unescape
from html.parser import HTMLParser

import pytest
from axe_playwright_python.sync_playwright import Axe

from service.errors import KINDS
from tests.service.page.browsing import tab


def test_every_path_and_field_is_told(server):
    page = unescape(server.http.get("/docs").text)
    told = server.http.get("/openapi.json").json()
    for path, operations in told["paths"].items():
        for method in operations:
            assert f"{method.upper()} {path}</code>" in page
    for field, schema in told["components"]["schemas"]["SynthesisRequest"]["properties"].items():
        assert f"<code>{field}</code>" in page
        assert re.sub(r"`([^`]+)`", r"<code>\1</code>", schema.get("description", "")) in page
    assert "`" not in page
    names = set(re.findall(r"<a href='#(\w+)'", page))
    assert names <= set(re.findall(r"<h3 id='(\w+)'", page))
    assert len(names) > 10


def test_nothing_is_loaded_from_elsewhere(server):
    answer = server.http.get("/docs")
    assert answer.headers["content-security-policy"].startswith("default-src 'none'")
    assert "unsafe" not in answer.headers["content-security-policy"]
    loaded = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag, attrs):
            told = dict(attrs)
            loaded.extend([told.get("src") or told["href"]] if tag in ("script", "link", "img", "iframe") else [])

    Reader().feed(answer.text)
    assert sorted(address.partition("-")[0] for address in loaded) == ["assets/docs", "assets/try"]
    assert all(server.http.get(f"/{address}").status_code == 200 for address in loaded)
    assert server.http.get("/redoc").status_code == 404


def test_every_kind_of_problem_is_told_where_its_type_points(server):
    page = server.http.get("/docs").text
    problem = server.http.get("/v1/models/walk/nobody").json()
    assert problem["type"] == "/docs#not-found"
    for kind in KINDS:
        assert f"id='{kind}'" in page


def tried(seen, operation, **fields):
    """Fill in and send an operation's form; its answer."""
    place = f"#{operation} .try"
    seen.page.locator(f"{place} summary").click()
    for name, value in fields.items():
        seen.page.fill(f"{place} [name={name}]", value)
    seen.page.locator(f"{place} button").click()
    seen.until(f"/^\\d/.test(document.querySelector('{place} .answer').textContent)", 60)
    return seen.page.locator(f"{place} .answer")


@pytest.mark.slow
def test_calls_are_tried_in_the_page(browser, server):
    seen = tab(browser, server.url)
    seen.page.goto(f"{server.url}/docs")
    assert "left_knee_flexion" in tried(seen, "describe_body").inner_text()
    answer = tried(seen, "synthesize_walk")
    assert "200" in answer.inner_text()
    assert '"fps":30' in answer.inner_text()
    wrong = tried(seen, "sample_poses", body='{"temperatur": 1}')
    assert "422" in wrong.inner_text()
    assert "did you mean temperature?" in wrong.inner_text()
    film = tried(seen, "make_stimuli", accept="application/zip")
    assert film.locator("a").get_attribute("download") == "zip"
    gone = tried(seen, "get_job")
    assert "404" in gone.inner_text()
    assert seen.complaints == [] or all("404" in one or "422" in one for one in seen.complaints)
    found = Axe().run(seen.page)
    assert found.violations_count == 0, found.generate_report()
    seen.picture("docs")
