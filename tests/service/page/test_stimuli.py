"""The dialogue of stimuli for experiments."""

import io
import json
import zipfile

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from PIL import Image

from motionenv.data.stimuli import Display, StimulusSet, frames_of
from tests.service.page.browsing import DESK, PHONE, tab

STATE = (
    "model=walk/fpca&walker=1,-0.5&speed=1.6&stimulus=1&stimulus.mask=30&stimulus.dots=8&stimulus.lifetime=0.25"
    "&stimulus.view=90&stimulus.seed=7&stimulus.width=240&stimulus.height=240&stimulus.seconds=0.5&stimulus.fps=30"
    "&stimulus.format=png"
)


def opened(browser, server, state=STATE, size=DESK, **options):
    seen = tab(browser, server.url, size, **options)
    seen.page.goto(f"{server.url}/#{state}")
    seen.until("globalThis.motionenv?.stimuli?.painted === 0", 120)
    return seen


def downloaded(seen) -> zipfile.ZipFile:
    with seen.page.expect_download() as download:
        seen.page.get_by_role("button", name="Download", exact=True).click()
    assert download.value.suggested_filename.startswith("motionenv-stimuli-")
    return zipfile.ZipFile(download.value.path())


def put(seen, name, value):
    seen.page.fill(f"dialog [name={name}]", str(value))
    seen.page.keyboard.press("Tab")


def test_the_page_knows_every_setting_with_its_default_and_bounds(browser, server):
    seen = opened(browser, server, "model=walk/fpca&stimulus=1")
    names = set(seen.ask("Array.from(motionenv.stimuli.inputs.keys())"))
    stimulus = seen.ask("motionenv.state.stimulus")
    fields = {**Display.model_fields, **StimulusSet.model_fields}
    assert names == stimulus.keys() == fields.keys() - {"people", "displays"}
    for name, default in stimulus.items():
        assert default == fields[name].default
        field = seen.page.locator(f"dialog [name={name}]")
        for bound, edge in (("min", "ge"), ("max", "le")):
            limit = field.get_attribute(bound)
            told = [getattr(m, edge) for m in fields[name].metadata if hasattr(m, edge)]
            if limit is not None and told:
                assert float(limit) == told[0], name


def test_what_is_seen_is_what_the_files_show(browser, server):
    seen = opened(browser, server)
    files = downloaded(seen)
    asked = StimulusSet.of(json.loads(files.read("stimuli.json"))["set"])
    (person,), (display,) = asked.people, asked.displays
    assert (display.mask, display.lifetime, display.seed, person.speed) == (30, 0.25, 7, 1.6)
    film = list(frames_of(asked, person, display))
    kept = np.asarray(Image.open(io.BytesIO(files.read("person-001-display-001/000000.png"))))
    np.testing.assert_array_equal(kept, film[0])
    shown = np.array(
        seen.ask(
            "{ const c = motionenv.stimuli.canvas;"
            " return c.getContext('2d').getImageData(0, 0, c.width, c.height).data; }"
        )
    ).reshape(240, 240, 4)[..., 0]
    # The canvas smooths edges in its own way, on dots of a few pixels: where they are is compared.
    rows, columns = np.mgrid[:240, :240]
    for frame in (film[0][..., 0], shown):
        assert 100 < (frame > 128).sum() < 5000
    both = [
        np.array([(p * (f / 255.0)).sum() for p in (rows, columns)]) / (f / 255.0).sum()
        for f in (film[0][..., 0], shown)
    ]
    np.testing.assert_allclose(*both, atol=0.6)
    overlap = ((film[0][..., 0] > 128) & (shown > 128)).sum() / ((film[0][..., 0] > 128) | (shown > 128)).sum()
    assert overlap > 0.7
    seen.picture("stimulus")


def test_several_displays_of_two_walkers_make_a_set(browser, server):
    seen = opened(browser, server, STATE.replace("walker=1,-0.5", "walker=1&walker2=-1"))
    seen.page.get_by_role("button", name="Add to the set").click()
    seen.page.check("dialog [name=inverted]")
    seen.page.get_by_role("button", name="Add to the set").click()
    assert "4 stimuli, 2 × 2 of walkers × displays, of 15 frames" in seen.page.inner_text("dialog [role=status]")
    told = json.loads(downloaded(seen).read("stimuli.json"))
    assert [d["inverted"] for d in told["set"]["displays"]] == [False, True]
    assert [p["deviations"][0] for p in told["set"]["people"]] == [1, -1]
    assert len({s["sha256_of_pixels"] for s in told["stimuli"]}) == 4
    seen.page.get_by_role("button", name="Empty the set").click()
    assert "2 stimuli, 2 × 1" in seen.page.inner_text("dialog [role=status]")


def test_what_cannot_be_is_told(browser, server):
    seen = opened(browser, server, "model=walk/fpca&stimulus=1")
    download = seen.page.get_by_role("button", name="Download", exact=True)
    put(seen, "lifetime", 0.3)
    assert "fewer dots at a time than 15" in seen.page.inner_text("dialog [role=status]")
    assert download.is_disabled()
    lifetime = seen.page.locator("dialog [name=lifetime]")
    told = "label:has([name=lifetime]) + .wrong"
    assert "fewer dots at a time than 15" in seen.page.inner_text(told), "beside the field"
    assert lifetime.get_attribute("aria-invalid") == "true"
    assert seen.page.locator(told).get_attribute("id") == lifetime.get_attribute("aria-describedby")
    seen.picture("stimulus-lifetime")
    put(seen, "dots", 99)
    assert seen.page.is_visible("label:has([name=dots]) + .wrong")
    put(seen, "dots", 6)
    assert download.is_enabled()
    assert seen.page.locator("dialog .wrong").count() == 0
    assert lifetime.get_attribute("aria-invalid") == "false"
    put(seen, "contrast", 0)
    assert "as grey as the background" in seen.page.inner_text("dialog [role=status]")
    put(seen, "contrast", "")
    put(seen, "view", 1000)
    assert "360 is used; it can be from -360 to 360" in seen.page.inner_text("dialog [role=status]")
    put(seen, "fps", 240)
    put(seen, "seconds", 60)
    assert "7200 frames at most" in seen.page.inner_text("dialog [role=status]")
    assert seen.complaints == []


def test_the_preview_can_be_seen_at_twice_the_size(browser, server):
    """At a zoom of 200 %, a desk of 1280 × 800 has 640 × 400."""
    seen = tab(browser, server.url, (640, 400)).open("model=walk/fpca")
    seen.page.evaluate("() => motionenv.stimulate()")
    box = seen.page.locator("dialog canvas").bounding_box()
    assert min(box["width"], box["height"]) >= 200
    assert seen.page.locator("dialog .settings").bounding_box()["height"] >= 100
    seen.picture("stimuli-at-200")
    seen.page.context.close()


def test_a_link_brings_the_stimulus_back_and_closing_keeps_the_settings(browser, server):
    seen = opened(browser, server)
    before = seen.ask("motionenv.state.stimulus")
    put(seen, "roll", 33)
    seen.until("location.hash.includes('stimulus.roll=33')")
    again = opened(browser, server, seen.page.evaluate("() => location.hash.slice(1)"))
    assert again.ask("motionenv.state.stimulus") == {**before, "roll": 33}
    again.page.keyboard.press("Escape")
    again.until("!location.hash.includes('stimulus')")
    again.page.click("#stimulate")
    assert again.ask("motionenv.state.stimulus.roll") == 33
    again.page.evaluate("() => { location.hash = '#model=walk/eigenwalkers'; }")
    again.until("motionenv.state.model === 'walk/eigenwalkers' && !document.querySelector('dialog')")


def test_a_tree_and_odd_links_open_nothing_or_what_is_possible(browser, server):
    seen = tab(browser, server.url).open("model=mixed/tree&stimulus=1")
    assert seen.page.locator("dialog").count() == 0
    assert seen.page.is_disabled("#stimulate")
    odd = opened(
        browser,
        server,
        "model=walk/fpca&stimulus=1&stimulus.mask=1e9&stimulus.view=x&stimulus.format=exe&stimulus.size=-3",
    )
    told = odd.ask("motionenv.state.stimulus")
    assert (told["mask"], told["view"], told["format"], told["size"]) == (1000, 0, "mp4", 0.05)
    assert odd.complaints == []


@pytest.mark.parametrize("size", [DESK, PHONE])
def test_the_dialogue_has_no_barrier_and_fits(browser, server, size):
    seen = opened(browser, server, size=size, color_scheme="dark")
    found = Axe().run(seen.page)
    assert found.violations_count == 0, found.generate_report()
    assert seen.ask("document.querySelector('dialog').scrollWidth") <= size[0]
    widths = (
        "Array.from(document.querySelectorAll('dialog input[type=number]')).map((e) => e.scrollWidth - e.clientWidth)"
    )
    assert max(seen.ask(widths)) <= 0  # every number can be read
    seen.page.focus("dialog [name=view]")
    seen.page.keyboard.press("ArrowUp")
    assert seen.ask("motionenv.state.stimulus.view") == 95
    seen.picture(f"stimulus-{size[0]}")
