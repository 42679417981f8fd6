"""Debian's Chromium for the tests of the page, and what they ask of it."""

import json
import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]
ARTEFACTS = ROOT / "build" / "page"
FLAGS = ["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
DESK, PHONE = (1000, 640), (360, 740)


def chromium_path() -> str:
    """The path of Chromium; without it, tests skip, or fail where MOTIONENV_REQUIRE_CHROMIUM is set."""
    chromium = shutil.which("chromium")
    if chromium is None:
        refuse = pytest.fail if os.environ.get("MOTIONENV_REQUIRE_CHROMIUM") else pytest.skip
        refuse("Chromium isn't installed: apt-get install chromium")
    return str(chromium)


class Tab:
    """One page, and what its console said.

    Args:
        page: of Playwright.
        url: of the service.
    """

    def __init__(self, page: Any, url: str):
        self.page, self.url = page, url
        self.complaints: list[str] = []
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))

    def _heard(self, message: Any) -> None:
        # SwiftShader says that of screenshots; a service that is busy is waited for.
        expected = "GPU stall" in message.text or "status of 503" in message.text
        if message.type in ("error", "warning") and not expected:
            self.complaints.append(message.text)

    def open(self, state: str = "") -> "Tab":
        """Go to the page in a state, and wait until somebody walks."""
        self.page.goto("about:blank")
        self.page.goto(f"{self.url}/#{state}")
        ready = "globalThis.motionenv?.stats.frames > 0 && document.getElementById('loading').hidden"
        self.until(ready, 120)  # a busy service still loads the tree
        return self

    def ask(self, expression: str) -> Any:
        """What an expression is in the page; through JSON, which numbers in typed arrays don't take by themselves."""
        plain = "(key, value) => ArrayBuffer.isView(value) ? Array.from(value) : value"
        text = self.page.evaluate(f"() => JSON.stringify((() => {expression})() ?? null, {plain})")
        return json.loads(text)

    def until(self, condition: str, seconds: float = 15) -> None:
        """Wait until a condition holds; the page's own policy forbids Playwright's way, which is eval."""
        end = time.monotonic() + seconds
        while not self.page.evaluate(f"() => Boolean({condition})"):
            note = self.page.evaluate("() => document.getElementById('note')?.textContent")
            assert time.monotonic() < end, f"never: {condition}; the page says {note!r}, the console {self.complaints}"
            time.sleep(0.05)

    def still(self, phase: float = 0.3) -> "Tab":
        """Stand still at a moment of the cycle, drawn."""
        frames = self.page.evaluate(f"() => {{ motionenv.scrub({phase}); return motionenv.stats.frames; }}")
        self.until(f"motionenv.stats.frames > {frames}")
        return self

    def picture(self, name: str) -> bytes:
        """A screenshot, kept as an artefact."""
        ARTEFACTS.mkdir(parents=True, exist_ok=True)
        return self.page.screenshot(path=ARTEFACTS / f"{re.sub(r'[^a-z0-9]+', '-', name)}.png")


@contextmanager
def launched() -> Iterator[Any]:
    """A running Chromium."""
    from playwright.sync_api import sync_playwright

    path = chromium_path()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


def tab(browser: Any, url: str, size: tuple[int, int] = DESK, *, walking: bool = False, **options: Any) -> Tab:
    """A new page of `size` [pixels] in a context of its own.

    Unless somebody should be `walking` the system asks for less motion, and the page begins at a standstill: drawing
    without a graphics processor takes more than a core.
    """
    motion = "no-preference" if walking else "reduce"
    view = {"width": size[0], "height": size[1]}
    context = browser.new_context(viewport=view, accept_downloads=True, reduced_motion=motion, **options)
    return Tab(context.new_page(), url)
