"""The page in Chromium without a graphics card: first walking frame, script per frame, frames per second, bundle.

    motionenv bench service.page

It starts a service on a free port, with the page built in service/web/dist, and drives Debian's Chromium with
SwiftShader. "Script" is all JavaScript of a frame, including three.js and its calls to WebGL. The time of the first
walking frame starts with the navigation, with an empty browser cache.
"""

import gzip
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager

from benchmarks import ROOT, Arguments, Skipped, needs

needs("playwright")
from playwright.sync_api import sync_playwright

FLAGS = ["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
STATES = {
    "body": "model=walk/fpca",
    "stick figure": "model=walk/fpca&figure=stick",
    "point lights": "model=walk/eigenwalkers&figure=points&lines=1",
    "two bodies": "model=walk/fpca&walker=1&walker2=-1,1",
    "tree": "model=mixed/tree",
}
STAGE = (640, 480)


@contextmanager
def service() -> Iterator[str]:
    """Run a service and yield its address."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"MOTIONENV_SERVICE_PORT": "0", "MOTIONENV_SERVICE_DATA": folder}
        process = subprocess.Popen(
            [sys.executable, "-m", "service"], cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True
        )
        try:
            line = next(line for line in process.stderr if "running on" in line)
            yield re.search(r"http://[^\s\"]+", line)[0]
        finally:
            process.terminate()
            process.wait(40)


def opened(browser, url: str, state: str):
    """Open the page in a new browser context of 640 × 480 pixels, and wait until the body walks."""
    page = browser.new_context(viewport={"width": STAGE[0], "height": STAGE[1]}).new_page()
    page.goto(f"{url}/#{state}")
    until(page, "globalThis.motionenv?.stats.frames > 5")
    return page


def until(page, condition: str, seconds: float = 120) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not page.evaluate(f"() => Boolean({condition})"):
        assert time.monotonic() < end, condition
        time.sleep(0.02)


def enlarge(page) -> None:
    """Make the stage fill the window."""
    page.evaluate(
        "() => { document.body.style.overflow = 'hidden';"
        "  const whole = {border: 0, height: '100vh', position: 'fixed', width: '100vw'};"
        "  Object.assign(document.getElementById('stage').style, whole); }"
    )
    page.wait_for_timeout(1500)
    assert tuple(page.evaluate("() => [motionenv.stage.canvas.width, motionenv.stage.canvas.height]")) == STAGE


def frames(page, seconds: int) -> tuple[float, float, float]:
    """Frames per second, and the median and 99th percentile of script per frame [ms]."""
    before = page.evaluate("() => motionenv.stats.frames")
    start = time.perf_counter()
    page.wait_for_timeout(1000 * seconds)
    counted = page.evaluate("() => motionenv.stats.frames") - before
    rate = counted / (time.perf_counter() - start)
    times = page.evaluate("() => motionenv.stats.times.map(([begun, , drawn]) => drawn - begun)")[-counted:]
    return rate, statistics.median(times), statistics.quantiles(times, n=100)[98]


def first_frame(browser, url: str) -> float:
    """Seconds from navigation to the first walking frame."""
    page = opened(browser, url, STATES["body"])
    seconds = page.evaluate("() => performance.getEntriesByName('walking')[0].startTime") / 1000
    page.context.close()
    return seconds


def slider(page) -> tuple[float, int]:
    """Script time [ms] of moving a slider, and at most how many frames pass until the service's stride is drawn."""
    return page.evaluate(
        """async () => {
          const input = document.querySelector('#traits input'), spent = [], waited = [];
          for (let i = 0; i < 60; i++) {
            await new Promise(requestAnimationFrame);
            const [before, cycle] = [motionenv.stats.frames, motionenv.walkers[0].cycle];
            input.value = -2 + i / 15;  // another walker each time: strides are kept
            const begun = performance.now();
            input.dispatchEvent(new Event('input', {bubbles: true}));
            spent.push(performance.now() - begun);
            while (motionenv.walkers[0].cycle === cycle) await new Promise(requestAnimationFrame);
            await new Promise(requestAnimationFrame);
            waited.push(motionenv.stats.frames - before);
          }
          spent.sort((a, b) => a - b);
          return [spent[30], Math.max(...waited)];
        }"""
    )


def main() -> None:
    """Measure, and print a table."""
    quick = Arguments(__doc__).parse_args().quick
    seconds, starts = (1, 1) if quick else (5, 5)
    if shutil.which("chromium") is None:
        raise Skipped("Chromium is missing: apt install chromium")
    scripts = [path.read_bytes() for path in (ROOT / "service" / "web" / "dist" / "assets").glob("*.js")]
    with service() as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        first_frame(browser, url)
        firsts = sorted(first_frame(browser, url) for _ in range(starts))
        print("| page | measured | goal |\n|-|-|-|")
        print(f"| bundle, gzip | {sum(len(gzip.compress(s, 9)) for s in scripts) / 1000:.0f} kB | 200 kB |")
        middle = firsts[starts // 2]
        print(f"| first walking frame, median (worst) of {starts} | {middle:.2f} s ({firsts[-1]:.2f} s) | 0.5 s |")
        for name, state in STATES.items():
            page = opened(browser, url, state)
            enlarge(page)
            rate, median, worst = frames(page, seconds)
            print(f"| {name}, 640 × 480: frames/s | {rate:.0f} | 30 |")
            print(f"| {name}: script per frame, median (99 %) | {median:.2f} ms ({worst:.1f} ms) | 1 ms |")
            if name == "body":
                spent, waited = slider(page)
                print(f"| slider: script; frames until its stride is shown | {spent:.1f} ms; {waited} | 2 ms; 6 |")
            page.context.close()
        browser.close()


if __name__ == "__main__":
    main()
