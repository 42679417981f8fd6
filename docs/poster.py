"""Make the picture that the page shows until its script is there: the average walker as the stage draws it.

python docs/poster.py http://127.0.0.1:8000, of a running service; then build the page again.
"""

import base64
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

_DRAWN = """() => {
  const { stage } = motionenv;
  motionenv.scrub(0.08);
  motionenv.frame(performance.now());
  stage.draw(true);
  const picture = Object.assign(document.createElement("canvas"), { width: 400, height: 640 }); // as high as the stage
  const { width, height } = stage.canvas;
  const wide = (height * picture.width) / picture.height;
  const drawn = picture.getContext("2d");
  drawn.drawImage(stage.canvas, (width - wide) / 2, 0, wide, height, 0, 0, picture.width, picture.height);
  return picture.toDataURL("image/webp", 0.5);
}"""


def main(url: str) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium",
            args=["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
        )
        page = browser.new_page(viewport={"width": 1000, "height": 640})
        page.goto(url)
        while not page.evaluate("() => Boolean(globalThis.motionenv?.stats.frames)"):
            page.wait_for_timeout(50)
        data = page.evaluate(_DRAWN)
        browser.close()
    (Path(__file__).parents[1] / "service" / "web" / "src" / "poster.webp").write_bytes(
        base64.b64decode(data.partition(",")[2])
    )


if __name__ == "__main__":
    main(sys.argv[1])
