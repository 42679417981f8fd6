"""What somebody sees who knows nothing of the page: what is set, where things are, and what files are called."""

import re

import pytest

import motionenv
from tests.service.page.browsing import DESK, PHONE, tab


def put(seen, selector, value):
    seen.page.eval_on_selector(
        selector, "(e, value) => { e.value = value; e.dispatchEvent(new Event('input', { bubbles: true })); }", value
    )


def output(seen, name):
    return seen.page.locator("#body .slider", has_text=name).locator("output").inner_text()


@pytest.mark.parametrize("person", ["woman", "child"])
def test_everybody_has_a_weight(browser, server, person):
    seen = tab(browser, server.url).open(f"model=walk/fpca&drawn=1&seed=7&who={person}")
    told = server.http.post("/v1/cycles", json={"seed": 7, "person": person}).json()
    assert output(seen, "Weight") == f"{told['weight']:.0f} kg"
    assert output(seen, "Height") == f"{told['height']:.2f} m"
    put(seen, "#traits input", 1.0)
    seen.until("!motionenv.one.drawn && !motionenv.walkers[0].asking")
    assert output(seen, "Weight") == f"{told['weight']:.0f} kg", "somebody of the same build"
    seen.page.context.close()


def test_the_present_view_is_marked_until_the_camera_moves(browser, server):
    seen = tab(browser, server.url).open("model=walk/fpca")
    pressed = "[...document.querySelectorAll('[data-view][aria-pressed=true]')].map((button) => button.textContent)"
    assert seen.ask(pressed) == ["Oblique"]
    for name in ("Front", "Side"):
        seen.page.get_by_role("button", name=name, exact=True).click()
        assert seen.ask(pressed) == [name]
    box = seen.page.locator("#view").bounding_box()
    seen.page.mouse.move(box["x"] + 200, box["y"] + 200)
    seen.page.mouse.down()
    seen.page.mouse.move(box["x"] + 260, box["y"] + 200, steps=4)
    seen.page.mouse.up()
    seen.until(f"!({pressed}).length")
    seen.page.context.close()


def test_a_lock_says_what_it_does(browser, server):
    seen = tab(browser, server.url).open("model=walk/fpca")
    assert not seen.page.is_visible("#held-hint")
    put(seen, "#traits input", 1.5)
    name = " – ".join(seen.page.locator("#traits .slider").first.locator(".low, .high").all_inner_texts())
    assert name in seen.page.inner_text("#held-hint")
    lock = seen.page.locator("#traits .lock").first
    assert lock.get_attribute("title").startswith("Held")
    lock.click()
    assert not seen.page.is_visible("#held-hint")
    assert lock.get_attribute("title").startswith("Moves along")
    seen.page.context.close()


def seen_at(selector):
    """Whether somebody sees the upper part of an element, which nothing covers, as JavaScript."""
    return (
        f"(() => {{ const box = document.querySelector('{selector}').getBoundingClientRect();"
        f" const seen = document.elementFromPoint(box.x + box.width / 2, box.y + 8);"
        f" return Boolean(seen?.closest('{selector}')); }})()"
    )


@pytest.mark.parametrize("size", [DESK, PHONE])
def test_saving_and_opening_a_capture_are_at_hand(browser, server, size):
    seen = tab(browser, server.url, size).open("model=walk/fpca")
    for button, place in (("#to-save", "#downloads"), ("#to-capture", "#capture .drop")):
        seen.page.evaluate("() => { document.querySelector('#controls').scrollTo(0, 0); scrollTo(0, 0); }")
        assert seen.ask(seen_at(button)) or size is PHONE
        assert not seen.ask(seen_at(place))
        if button == "#to-capture":
            with seen.page.expect_file_chooser() as chooser:
                seen.page.click(button)
            assert chooser.value.is_multiple()
        else:
            seen.page.click(button)
        seen.until(seen_at(place))
    seen.page.context.close()


@pytest.mark.parametrize(
    ("state", "suffix", "name"),
    [
        ("", "bvh", "motionenv-average.bvh"),
        ("drawn=1&seed=3&who=woman&camera=90,8,5.6&speed=0.8", "npz", "motionenv-woman-slow.npz"),
        (
            "weight=110&height=1.7&figure=points&inverted=1&camera=90,8,5.6",
            "mp4",
            "motionenv-heavy-points-upside-down-front.mp4",
        ),
    ],
)
def test_a_download_is_named_by_what_was_set(browser, server, state, suffix, name):
    seen = tab(browser, server.url).open(f"model=walk/fpca&{state}")
    seen.page.fill("#seconds", "1")
    with seen.page.expect_download(timeout=30_000) as coming:
        seen.page.click(f"[data-suffix={suffix}]")
    assert coming.value.suggested_filename == name
    seen.until(f"document.getElementById('download-note').textContent.includes('{name}')")
    seen.page.context.close()


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    path = tmp_path_factory.mktemp("capture") / "her walk.c3d"
    motionenv.write(motionenv.synthesize("walk/fpca", 5, 60, seed=7), path)
    return path


@pytest.mark.parametrize("size", [DESK, PHONE])
def test_a_capture_has_its_strides_choices_and_names(browser, server, capture, size):
    seen = tab(browser, server.url, size).open("model=walk/fpca")
    seen.page.set_input_files("#capture input[type=file]", capture)
    seen.until("document.querySelector('.capture-actions:not([hidden]) button.strong')", 120)
    strides = re.search(r"\d+ left strides and \d+ right strides", seen.page.inner_text(".found"))
    widths = seen.ask(
        "[...document.querySelectorAll('.capture-actions select')].map((select) => {"
        " const free = select.cloneNode(true);"
        " Object.assign(free.style, { position: 'fixed', flex: 'none', width: 'auto', maxWidth: 'none' });"
        " select.after(free); const natural = free.offsetWidth; free.remove();"
        " return [select.offsetWidth, natural]; })"
    )
    assert widths
    assert all(wide >= natural for wide, natural in widths), widths
    seen.picture(f"capture-{size[0]}")
    seen.page.locator(".capture-actions").get_by_role("button", name="Gait analysis").click()
    seen.page.wait_for_selector("dialog.gait-dialogue", timeout=120_000)
    assert strides[0] in seen.page.inner_text("dialog.gait-dialogue header")
    with seen.page.expect_download() as coming:
        seen.page.get_by_role("button", name="Save as CSV").click()
    assert coming.value.suggested_filename == "her-walk-gait.csv"
    seen.page.keyboard.press("Escape")
    assert seen.complaints == []
    seen.page.context.close()
