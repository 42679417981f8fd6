"""The site that Sphinx made: it opens from disk, leads nowhere wrong, and can be read by everybody.

Set MOTIONENV_SITE to the folder, as `.ci/run` does: sphinx-build -W -b html docs build/site
"""

import os
import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from axe_playwright_python.sync_playwright import Axe

from tests.service.page.browsing import launched

LOADED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src"), ("video", "src")}
#: One of each kind of page.
KINDS = (
    "index.html", "start/first-lift.html", "made/gallery/index.html", "made/gallery/6_papers/plot_b05_errors.html",
    "explanation/tracking.html", "made/environments/MarkerTracking.html", "made/leaderboard.html",
    "made/reference/motionenv.lifting.html", "search.html",
)  # fmt: skip


class Page(HTMLParser):
    """What a page refers to, the places in it that can be referred to, and its pictures."""

    def __init__(self, text: str):
        super().__init__()
        self.links: list[tuple[str, str, str]] = []
        self.names: set[str] = set()
        self.pictures: list[dict] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = {key: value or "" for key, value in attributes}
        self.names.add(given.get("id", ""))
        if tag == "img":
            self.pictures.append(given)
        for key in ("href", "src"):
            if key in given and given.get("rel") not in ("preconnect", "canonical"):
                self.links.append((tag, key, given[key]))


@pytest.fixture(scope="module")
def site() -> Path:
    """The folder of the site."""
    folder = os.environ.get("MOTIONENV_SITE")
    if not folder:
        pytest.skip("no site: sphinx-build -W -b html docs build/site, and set MOTIONENV_SITE to that folder")
    return Path(folder)


@pytest.fixture(scope="module")
def browser():
    """Chromium."""
    with launched() as running:
        yield running


@pytest.fixture(scope="module")
def pages(site) -> dict[Path, Page]:
    """Every page that readers see."""
    found = [path for path in site.rglob("*.html") if "_static" not in path.parts]
    assert len(found) > 100
    return {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in found}


def test_links_lead_to_pages_and_places_that_exist(pages):
    wrong = []
    for path, page in pages.items():
        for _, _, link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or "_modules" in path.parts:  # source code: of what has no page, too
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            place = unquote(parts.fragment)
            if not target.exists() or (place and target in pages and place not in pages[target].names):
                wrong.append(f"{path.name}: {link}")
    assert not wrong


def test_nothing_is_loaded_from_elsewhere(site, pages):
    for path, page in pages.items():
        assert not [link for tag, key, link in page.links if (tag, key) in LOADED and urlsplit(link).netloc], path
    for sheet in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*['\"]?https?:", sheet.read_text(encoding="utf-8")), sheet


def test_every_picture_says_what_it_shows(pages):
    for path, page in pages.items():
        shown = [p for p in page.pictures if not p["src"].endswith("_thumb.png")]  # beside the title of their example
        assert not [p for p in shown if not p.get("alt", "").strip() or p["alt"].endswith(".png")], path


def test_every_example_has_a_picture(site):
    examples = list((site / "made" / "gallery").glob("*/plot_*.html"))
    assert len(examples) >= 25
    assert not [page for page in examples if "sphx_glr_" not in page.read_text(encoding="utf-8")]


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("page", KINDS)
def test_axe_finds_no_barrier(browser, site, page, scheme):
    with browser.new_context(color_scheme=scheme, reduced_motion="reduce") as context:
        tab = context.new_page()
        tab.goto((site / page).resolve().as_uri())
        tab.wait_for_load_state("load")
        found = Axe().run(tab)
        assert found.violations_count == 0, found.generate_report()


def test_the_search_works_from_disk(browser, site):
    with browser.new_context() as context:
        tab = context.new_page()
        tab.goto((site / "search.html").resolve().as_uri() + "?q=silhouette")
        tab.locator("#search-results li").first.wait_for(timeout=60_000)
        assert "likelihood" in tab.locator("#search-results").inner_text().lower()


def test_somebody_walks_and_can_be_turned(browser, site):
    with browser.new_context(reduced_motion="no-preference") as context:
        tab = context.new_page()
        wrong: list[str] = []
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.goto((site / "index.html").resolve().as_uri())
        tab.wait_for_function("Number(document.querySelector('.walker').dataset.walking) > 0.1", timeout=120_000)
        tab.get_by_role("button", name="Pause").click()
        pictures = {tab.locator(".walker canvas").screenshot()}
        tab.get_by_role("slider", name="Turn").fill("-90")
        tab.wait_for_timeout(500)
        pictures.add(tab.locator(".walker canvas").screenshot())
        tab.get_by_role("combobox", name="Look").select_option("point lights")
        tab.wait_for_timeout(500)
        pictures.add(tab.locator(".walker canvas").screenshot())
        assert len(pictures) == 3
        assert not wrong
