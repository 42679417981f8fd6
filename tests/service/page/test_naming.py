"""The dialogue in which the user says which point of a capture file is which landmark."""

from dataclasses import replace

import numpy as np
import pytest

import motionenv
from motionenv.mocap import MarkerMap
from motionenv.types import MARKERS, POSE
from tests.service.jobs.handing import ODD, as_trc, odd_map, odd_points
from tests.service.page.browsing import ARTEFACTS, PHONE, tab

LEGS = tuple(marker for marker in MARKERS if marker == "pelvis" or marker.endswith(("hip", "knee", "ankle")))
KNEE = POSE.index("left_knee_flexion")
PANEL = "#capture-panel input[type=file]"


@pytest.fixture(scope="module")
def walk():
    return motionenv.synthesize("walk/fpca", 5, 60, seed=3, speed=1.2, variation=0)


@pytest.fixture(scope="module")
def odd(walk, tmp_path_factory):
    """A walk whose points have names that no marker set has."""
    path = tmp_path_factory.mktemp("capture") / "odd.trc"
    path.write_bytes(as_trc(*odd_points(walk), 60))
    return path


@pytest.fixture(scope="module")
def legs(walk, tmp_path_factory):
    """The same walk's pelvis and legs only."""
    path = tmp_path_factory.mktemp("capture") / "legs.trc"
    path.write_bytes(as_trc(*odd_points(walk, LEGS), 60))
    return path


@pytest.fixture
def fresh(browser, server):
    """A page of its own, which remembers nothing yet."""
    page = tab(browser, server.url).open("model=walk/fpca")
    yield page
    assert page.complaints == []
    page.page.context.close()


def named(shown, path):
    """The dialogue about a file, open."""
    shown.page.set_input_files(PANEL, path)
    button = shown.page.get_by_role("button", name="Name the points")
    button.wait_for(timeout=60_000)
    button.click()
    shown.until("document.querySelector('dialog.naming')?.open", 60)
    return shown.page.locator("dialog.naming")


def click(shown, point: str) -> None:
    """Click the dot of a point."""
    place = f"motionenv.naming.dots.at[motionenv.naming.found.points.indexOf('{point}')]"
    x, y = shown.ask(f"[{place}.x, {place}.y]")
    shown.page.locator("dialog canvas").click(position={"x": x, "y": y})


def entries(shown) -> dict:
    return shown.ask("Object.fromEntries(motionenv.naming.editor.entries)")


def choose(shown, landmark: str) -> None:
    """Select a landmark by its label, as a mouse does."""
    shown.page.locator(f"dialog label:has(input[value={landmark}])").click()


def status(shown) -> str:
    return shown.page.text_content("dialog .status")


def test_wrong_clicks_are_told(fresh, odd):
    dialog = named(fresh, odd)
    dialog.locator("canvas").click(position={"x": 8, "y": 8})
    assert entries(fresh) == {}
    choose(fresh, "left_knee")
    click(fresh, ODD["left_ankle"])
    assert entries(fresh) == {"left_knee": {ODD["left_ankle"]: 1}}
    assert fresh.ask("motionenv.naming.selected") == "left_ankle", "the next one"
    click(fresh, ODD["left_ankle"])
    assert entries(fresh) == {"left_ankle": {ODD["left_ankle"]: 1}}
    assert "It was the left knee" in status(fresh)
    choose(fresh, "left_ankle")
    click(fresh, ODD["left_ankle"])
    assert "already" in status(fresh)


def test_clicks_are_undone_one_by_one(fresh, odd):
    dialog = named(fresh, odd)
    choose(fresh, "left_knee")
    click(fresh, ODD["left_ankle"])
    click(fresh, ODD["left_ankle"])
    dialog.get_by_role("button", name="Undo").click()
    assert entries(fresh) == {"left_knee": {ODD["left_ankle"]: 1}}
    dialog.get_by_role("button", name="Clear all").click()
    fresh.page.keyboard.press("Control+z")
    fresh.page.keyboard.press("Control+z")
    assert entries(fresh) == {}
    assert dialog.get_by_role("button", name="Undo").is_disabled()


def test_what_is_still_needed_is_told(fresh, odd):
    dialog = named(fresh, odd)
    choose(fresh, "head")
    click(fresh, ODD["head"])
    dialog.get_by_role("button", name="Use these points").click()
    assert status(fresh).startswith("Still needed: both ASIS")
    choose(fresh, "left_hip")
    click(fresh, ODD["left_hip"])
    dialog.get_by_role("button", name="Use these points").click()
    assert status(fresh) == "Still needed: a knee."
    fresh.picture("naming-refused")
    fresh.page.keyboard.press("Escape")
    fresh.until("!document.querySelector('dialog')")
    assert fresh.ask("localStorage.length") == 0, "what is no motion isn't remembered"


@pytest.mark.slow
def test_points_are_named_used_remembered_and_saved(fresh, odd, walk, tmp_path):
    dialog = named(fresh, odd)
    assert "Still needed" in fresh.page.text_content("dialog .needs")
    for i, marker in enumerate(MARKERS):
        choose(fresh, marker)
        if i % 2:
            click(fresh, ODD[marker])
        else:
            dialog.get_by_label("Point", exact=True).select_option(ODD[marker])
    assert "Enough" in fresh.page.text_content("dialog .needs")
    fresh.picture("naming")
    with fresh.page.expect_download() as coming:
        dialog.get_by_role("button", name="Save map").click()
    assert coming.value.suggested_filename == "odd.toml"
    coming.value.save_as(tmp_path / "odd.toml")
    assert MarkerMap.parse((tmp_path / "odd.toml").read_text()).points == MarkerMap.parse(odd_map()).points
    dialog.get_by_role("button", name="Use these points").click()
    assert_shown(fresh, walk)
    fresh.open("model=walk/fpca")
    fresh.page.set_input_files(PANEL, odd)
    assert_shown(fresh, walk)
    fresh.page.get_by_role("button", name="Name the points").click()
    fresh.until("document.querySelector('dialog.naming')?.open", 60)
    assert entries(fresh) == {marker: {ODD[marker]: 1} for marker in MARKERS}


def assert_shown(shown, walk) -> None:
    """The capture is on the stage, without a dialogue, and moves as it did."""
    shown.until("motionenv.guest && !document.querySelector('dialog')", 60)
    poses = np.array(shown.ask("motionenv.guest.poses"), dtype=float)
    np.testing.assert_allclose(poses[:, KNEE], walk.poses[::2, KNEE], atol=np.radians(3))


def test_maps_are_loaded_and_what_is_none_is_told(fresh, odd, tmp_path):
    named(fresh, odd)
    for name, text in (("ours.toml", odd_map() + 'c7 = "Nape"\n'), ("bad.toml", '[points]\nleft_kneecap = "K"\n')):
        (tmp_path / name).write_text(text)
    load = fresh.page.get_by_label("Load a marker map")
    load.set_input_files(tmp_path / "ours.toml")
    fresh.until("document.querySelector('dialog .status').textContent.includes('C7')", 60)
    loaded = entries(fresh)
    assert loaded == {marker: {ODD[marker]: 1} for marker in MARKERS}
    load.set_input_files(tmp_path / "bad.toml")
    fresh.until("document.querySelector('dialog .status.bad')", 60)
    assert "left_kneecap" in status(fresh)
    assert entries(fresh) == loaded
    fresh.complaints.clear()  # the console's word for the answer 422


def test_the_dialogue_is_used_by_keyboard(fresh, odd):
    named(fresh, odd)
    press = fresh.page.keyboard.press
    first = fresh.ask("document.activeElement.value")
    press("ArrowDown")
    second = fresh.ask("document.activeElement.value")
    assert fresh.ask("motionenv.naming.selected") == second != first
    press("n")
    press("c")
    assert fresh.ask("[motionenv.one.deviations.length, motionenv.walkers.length]") == [0, 1], "the page's own keys"
    fresh.page.focus("dialog select")
    press("ArrowDown")
    press("Enter")
    assert entries(fresh) == {second: {ODD["head"]: 1}}
    fresh.page.focus("dialog canvas")
    before = fresh.ask("motionenv.naming.dots.view")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        press(key)
    around, up, away = fresh.ask("motionenv.naming.dots.view")
    assert around == pytest.approx(before[0] - 6, abs=0.1)
    assert up == pytest.approx(before[1] + 6, abs=0.1)
    assert away < before[2]
    seen = fresh.ask(
        "[...document.querySelectorAll('dialog button:enabled, dialog select, dialog canvas, dialog input[type=file]')]"
        ".filter((e) => { e.focus({focusVisible: true}); const s = e.type === 'file' ? e.nextElementSibling : e;"
        " return getComputedStyle(s).outlineStyle === 'none'; }).map((e) => e.outerHTML)"
    )
    assert seen == []


def test_the_dialogue_fits_a_phone(browser, server, odd):
    small = tab(browser, server.url, PHONE).open("model=walk/fpca")
    dialog = named(small, odd)
    outside = small.ask(
        "[...document.querySelectorAll('dialog :is(button, canvas, select, label, p)')].filter((e) => {"
        " const b = e.getBoundingClientRect(); return b.width > 1 && (b.right > 360.5 || b.left < -0.5); })"
        ".map((e) => e.outerHTML)"
    )
    assert outside == []
    assert dialog.locator(".landmarks").bounding_box()["height"] > 120
    choose(small, "head")
    click(small, ODD["head"])
    assert entries(small) == {"head": {ODD["head"]: 1}}
    small.picture("naming-phone")
    small.page.context.close()


@pytest.mark.slow
@pytest.mark.parametrize("figure", ["body", "stick", "points&lines=1"])
def test_limbs_that_are_unknown_are_not_drawn(fresh, walk, tmp_path, figure):
    poses = walk.poses.copy()
    poses[:, POSE.index("neck_flexion") : POSE.index("left_hip_flexion")] = np.nan
    poses[:, POSE.index("right_hip_flexion") :] = np.nan
    motionenv.write(replace(walk, poses=poses), tmp_path / "leg.npz")
    fresh.open(f"model=walk/fpca&figure={figure}")
    fresh.page.set_input_files(PANEL, tmp_path / "leg.npz")
    fresh.until("motionenv.guest", 60)
    fresh.still(0.5)
    fresh.picture(f"one-leg-{figure[:5]}")
    if figure == "body":
        drawn = fresh.ask("motionenv.stage.figures[0].limbs.map((mesh) => mesh.visible)")
        assert drawn == [limb in ("pelvis", "left_thigh", "left_shin", "left_foot") for limb in motionenv.body.LIMBS]
    else:
        sizes = fresh.ask("motionenv.stage.figures[0].joints.instanceMatrix.array")[::16]
        known = {"pelvis", "left_hip", "right_hip", "left_knee", "left_ankle"}
        assert {MARKERS[i] for i, size in enumerate(sizes) if size} == known


@pytest.mark.slow
def test_legs_are_filled_and_saved_in_other_formats(fresh, legs, tmp_path):
    named(fresh, legs)
    (tmp_path / "ours.toml").write_text(odd_map(LEGS))
    fresh.page.get_by_label("Load a marker map").set_input_files(tmp_path / "ours.toml")
    fresh.until("motionenv.naming.editor.entries.size", 60)
    fresh.page.get_by_role("button", name="Use these points").click()
    fresh.until("motionenv.guest && !document.querySelector('dialog')", 60)
    fresh.picture("naming-legs")
    fresh.page.check("text=Fill in what wasn't captured")
    with fresh.page.expect_download(timeout=90_000) as coming:
        fresh.page.locator("#capture").get_by_role("button", name="BVH").click()
    assert coming.value.suggested_filename == "legs.bvh"
    coming.value.save_as(tmp_path / "legs.bvh")
    assert np.isfinite(motionenv.read(tmp_path / "legs.bvh").positions).all()


def test_a_report_opens_in_a_page_of_its_own(fresh, walk, tmp_path):
    motionenv.write(walk, tmp_path / "anna_01.npz")
    fresh.page.set_input_files(PANEL, tmp_path / "anna_01.npz")
    button = fresh.page.get_by_role("button", name="Gait report")
    button.wait_for(timeout=60_000)
    with fresh.page.context.expect_page(timeout=120_000) as coming:
        button.click()
    report = coming.value
    report.wait_for_load_state()
    assert report.title() == "Gait report: walk"
    assert report.locator("svg").count() > 4
    ARTEFACTS.mkdir(parents=True, exist_ok=True)
    report.screenshot(path=ARTEFACTS / "report.png")
    assert fresh.page.get_by_role("link", name="Open the report").get_attribute("href").endswith("/result")
