"""`/docs` tells everything that the OpenAPI does, and loads nothing from anywhere."""

import re
from html import unescape
from html.parser import HTMLParser


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
    loaded = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag, attrs):
            loaded.extend([tag] if tag in ("script", "link", "img", "iframe") else [])

    Reader().feed(answer.text)
    assert not loaded
    assert server.http.get("/redoc").status_code == 404
