"""The gait of walkers and of captures on the page: what is drawn and saved is what the service found."""

import csv
import re

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe

import motionenv
from tests.service.page.browsing import DESK, PHONE, tab


def opened(seen):
    seen.page.wait_for_selector("dialog.gait-dialogue", timeout=120_000)
    return seen.page.locator("dialog.gait-dialogue")


@pytest.mark.parametrize("size", [DESK, PHONE])
def test_a_walkers_gait_is_shown_beside_peoples(browser, server, size):
    seen = tab(browser, server.url, size, color_scheme="light")
    seen.open("model=walk/fpca&walker=1,0.5&speed=1.5")
    seen.page.click("#gait")
    shown = opened(seen)
    assert shown.locator("figure").count() == 4
    assert shown.locator("polygon.band").count() == 4
    told = server.http.post(
        "/v1/gait",
        json={"model": "walk/fpca", "speed": 1.5, "deviations": [1, 0.5, 0, 0, 0, 0, 0, 0], "seed": 0, "variation": 0},
    ).json()
    label = shown.locator("svg[aria-label^='Knee flexion']").get_attribute("aria-label")
    knee = told["angles"]["left_knee_flexion"]["mean"]
    assert f"left from {round(min(knee))} to {round(max(knee))} degrees" in label
    table = shown.locator("table").first.inner_text()
    cadence = next(one["mean"] for one in told["parameters"] if one["name"] == "cadence")
    assert f"{cadence:.1f}" in table
    profile = shown.locator("table").nth(1).inner_text()
    assert "no Gait Profile Score" in profile
    assert f"{told['profile'][0]['value']:.1f}" in profile
    found = Axe().run(seen.page)
    assert found.violations_count == 0, found.generate_report()
    assert seen.ask("document.querySelector('dialog').scrollWidth") <= size[0]
    seen.picture(f"gait-{size[0]}")
    with seen.page.expect_download() as download:
        shown.get_by_role("button", name="Save as CSV").click()
    rows = list(csv.DictReader(download.value.path().read_text().splitlines()))
    kept = [float(r["mean"]) for r in rows if (r["name"], r["side"], r["kind"]) == ("knee_flexion", "left", "angle")]
    np.testing.assert_allclose(kept, knee)
    seen.page.keyboard.press("Escape")
    seen.until("!document.querySelector('dialog')")
    assert seen.complaints == []


def test_several_captures_become_one_gait(browser, server, tmp_path):
    for i in range(2):
        motionenv.write(motionenv.synthesize("walk/fpca", 5, 60, seed=7, phase=0.3 * i), tmp_path / f"her_{i}.c3d")
    seen = tab(browser, server.url).open("model=walk/fpca")
    seen.page.set_input_files("#capture input[type=file]", sorted(tmp_path.glob("*.c3d")))
    gait = seen.page.get_by_role("button", name="Gait analysis").last
    seen.until("document.querySelector('.capture-actions:not([hidden]) button.strong')", 120)
    gait.click()
    shown = opened(seen)
    assert "of 2 files" in shown.inner_text()
    assert re.search(r"\d+ strides", shown.inner_text())
    assert shown.locator("polygon.spread").count() >= 8
    assert shown.locator("svg[aria-label^='Knee flexion'] path.walk").count() == 4  # of two files and two sides
    bold = shown.locator("svg[aria-label^='Knee flexion'] path.left:not(.walk)")
    mean = bold.get_attribute("d")
    seen.picture("gait-capture")
    shown.locator("select").select_option(index=2)
    assert bold.get_attribute("d") != mean
    thin = shown.locator("svg[aria-label^='Knee flexion'] path.left.walk").nth(1)
    assert thin.locator("title").text_content() == shown.locator("option").nth(2).get_attribute("value")
    assert bold.get_attribute("d") == thin.get_attribute("d")
    assert seen.complaints == []


def test_one_stride_is_no_mean(browser, server, tmp_path):
    motionenv.write(motionenv.synthesize("walk/fpca", 2.4, 60, seed=7), tmp_path / "short.c3d")  # two left, one right
    seen = tab(browser, server.url).open("model=walk/fpca")
    seen.page.set_input_files("#capture input[type=file]", tmp_path / "short.c3d")
    gait = seen.page.get_by_role("button", name="Gait analysis").last
    seen.until("document.querySelector('.capture-actions:not([hidden]) button.strong')", 120)
    gait.click()
    shown = opened(seen)
    legend = shown.locator(".legend").inner_text()
    assert "left: mean ± SD of 2 strides" in legend
    assert "right: one stride" in legend
    knee = shown.locator("svg[aria-label^='Knee flexion']")
    assert knee.locator("path.right.single").count() == knee.locator("polygon.left.spread").count() == 1
    assert knee.locator("polygon.right.spread").count() == knee.locator("path.left.single").count() == 0
    row = shown.locator("tr", has_text="Stride time").inner_text()
    assert row.count("(one stride)") == 1
    assert "the right side has one stride" in shown.locator("ul.found").inner_text()
    seen.picture("gait-one-stride")
    assert seen.complaints == []


def test_a_tree_has_no_button_for_it(browser, server):
    seen = tab(browser, server.url).open("model=mixed/tree")
    assert seen.page.is_disabled("#gait")
