"""The page and its files: complete, compressed, cacheable, and under a strict content security policy."""

import gzip
import hashlib
import re

import httpx
import pytest

from service.jobs.uploads import SUFFIXES
from service.routes.page import FOLDER

WEB = FOLDER.parent


def test_there_is_a_page(server):
    answer = server.http.get("/")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert "motionenv" in answer.text
    policy = answer.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "unsafe" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_the_bundle_is_of_these_sources():
    """dist/SOURCES holds the digest of what `npm run build` read: after changing the page, run it again."""
    built_from = [*(WEB / "src").rglob("*"), *WEB.glob("*.json"), WEB / "build.mjs"]
    digest = hashlib.sha256()
    for name in sorted(path.relative_to(WEB).as_posix() for path in built_from if path.is_file()):
        digest.update(name.encode() + b"\0" + (WEB / name).read_bytes() + b"\0")
    assert digest.hexdigest() == (FOLDER / "SOURCES").read_text().strip(), "run `npm run build` in service/web"


def test_the_page_takes_what_the_service_takes():
    panel = (WEB / "src" / "capture" / "panel.js").read_text(encoding="utf-8")
    assert set(re.search(r'KINDS = "(.*?)"', panel)[1].split(",")) == set(SUFFIXES)


def test_what_the_page_names_is_there_and_kept_for_good(server):
    names = re.findall(r"(?:src|href)=\"(assets/[^\"]+)\"", server.http.get("/").text)
    assert len(names) == 3
    files = {path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*") if path.is_file()}
    of_docs = set(re.findall(r"assets/contents-[^\"]+", server.http.get("/docs").text))
    assert files == {*names, *of_docs, "index.html", "SOURCES"}
    assert all(re.search(r"-[A-Z0-9]{8}\.", name) for name in names)
    for name in names:
        answer = server.http.get(f"/{name}")
        assert answer.status_code == 200
        assert "immutable" in answer.headers["cache-control"]
        again = server.http.get(f"/{name}", headers={"If-None-Match": answer.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")


def test_the_bundle_is_small_and_comes_from_here_alone():
    scripts = list((FOLDER / "assets").glob("*.js"))
    assert scripts
    assert sum(len(gzip.compress(path.read_bytes(), 9)) for path in scripts) <= 200_000
    page = (FOLDER / "index.html").read_text()
    assert not re.search(r'(?:src|href)="(?:https?:)?//', page)
    assert not re.search(r"<script(?![^>]*src=)|<style|\sstyle=|\son\w+=", page)


def test_browsers_that_take_gzip_get_it(server):
    name = re.search(r"assets/main-[^\"]+", server.http.get("/").text)[0]
    with httpx.Client(base_url=server.url) as client:
        plain = client.get(f"/{name}", headers={"Accept-Encoding": "identity"})
        zipped = client.get(f"/{name}", headers={"Accept-Encoding": "gzip"})
    assert zipped.headers["content-encoding"] == "gzip"
    assert zipped.num_bytes_downloaded < 0.4 * len(plain.content)
    assert zipped.content == plain.content
    assert zipped.headers["vary"] == "Accept-Encoding"


@pytest.mark.parametrize(
    "path",
    ["/assets/..%2f..%2fapp.py", "/assets/%2e%2e/%2e%2e/settings.py", "/assets/SOURCES/..", "/assets/", "/assets/%00",
     "/assets/main.js", "/assets/index.html", "/assets/%ff"],
)  # fmt: skip
def test_nothing_else_is_sent(server, path):
    answer = server.http.get(path)
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
