"""The page for everybody: by keyboard, with a screen reader's names, without motion, without luck, and with a key."""

from dataclasses import replace

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe

import motionenv
from motionenv.types import POSE
from tests.service.page.browsing import DESK, PHONE, tab


def test_keys_work_where_no_field_is_in_use(shown):
    shown.open("model=walk/fpca")
    press = shown.page.keyboard.press
    press(" ")
    assert shown.ask("motionenv.paused") is True
    press(" ")
    assert shown.ask("motionenv.paused") is False
    press("3")
    assert shown.ask("motionenv.state.figure") == "points"
    press("1")
    press("n")
    assert shown.ask("motionenv.one.drawn")
    press("r")
    assert not shown.ask("motionenv.one.drawn")
    assert shown.ask("motionenv.one.deviations") == []
    press("c")
    assert shown.ask("motionenv.walkers.length") == 2
    shown.page.focus("#view")
    around, up, away = shown.ask("motionenv.stage.view")
    for key in ("ArrowRight", "ArrowUp", "+"):
        press(key)
    turned, raised, nearer = shown.ask("motionenv.stage.view")
    assert turned == pytest.approx(around + 6, abs=0.1)
    assert raised == pytest.approx(up + 6, abs=0.1)
    assert nearer < away


def test_every_control_is_reached_with_tab_and_can_be_seen_to_be(shown):
    shown.open("model=walk/fpca&figure=points")
    shown.ask("{ document.querySelectorAll('details').forEach((d) => (d.open = true)); }")
    reached = []
    for _ in range(120):
        shown.page.keyboard.press("Tab")
        reached.append(
            shown.ask(
                "{ const e = document.activeElement; const s = (e.type === 'radio' || e.type === 'checkbox') ?"
                " e.nextElementSibling : e.type === 'file' ? e.parentElement : e;"
                " return [e.id || e.getAttribute('aria-label') || e.textContent,"
                "         getComputedStyle(s).outlineStyle !== 'none' || e.matches('.skip')]; }"
            )
        )
        if reached[-1][0] == "Motion-capture files":
            break
    names = {name for name, _ in reached}
    assert {"view", "pause", "scrub", "randomise", "reset", "compare", "link", "seed", "seconds", "lines"} <= names
    assert len([name for name in names if "standard deviations" in name]) == 6 + 8
    assert [name for name, seen in reached if not seen] == []


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [DESK, PHONE])
def test_axe_finds_no_barrier(browser, server, size, scheme):
    for state in ("model=walk/fpca", "model=mixed/tree&figure=points&walker2="):
        # Without motion no colour is on its way to another one when axe looks at it.
        seen = tab(browser, server.url, size, color_scheme=scheme).open(state)
        seen.ask("{ document.querySelectorAll('details').forEach((d) => (d.open = true)); }")
        found = Axe().run(seen.page)
        assert found.violations_count == 0, found.generate_report()
        seen.page.context.close()


def test_fingers_find_everything(browser, server):
    """44 pixels each way, as WCAG 2.5.5 asks for; links within text may be smaller."""
    touched = tab(browser, server.url, PHONE, has_touch=True, is_mobile=True).open("model=walk/fpca&figure=points")
    touched.ask("{ document.querySelectorAll('details').forEach((d) => (d.open = true)); }")
    small = touched.ask(
        "[...document.querySelectorAll('button, input, select, summary')].filter((e) => e.offsetParent !== null)"
        ".map((e) => [e.id || e.textContent || e.getAttribute('aria-label') || e.name, e.getBoundingClientRect()])"
        ".filter(([, b]) => b.width > 0 && (b.width < 43.9 || b.height < 43.9)).map(([n, b]) => [n, b.width, b.height])"
    )
    touched.picture("touch")
    assert small == []
    touched.page.context.close()


def test_a_first_visit_is_told_what_to_do_once(browser, server):
    first = tab(browser, server.url).open()
    first.picture("first")
    assert first.page.is_visible("#welcome")
    first.page.click("#welcomed")
    assert not first.page.is_visible("#welcome")
    first.open("model=walk/eigenwalkers")
    assert not first.page.is_visible("#welcome")
    first.page.context.close()


def test_sliders_move_by_keyboard(shown):
    shown.open("model=walk/fpca")
    shown.page.focus("#traits input")
    shown.page.keyboard.press("End")
    assert shown.ask("document.querySelector('#traits output').textContent").startswith("+")
    assert shown.ask("document.querySelector('#traits input').getAttribute('aria-valuetext')").startswith("+")
    bouncy = "Math.max(...[0, 24, 48, 72].map((i) => motionenv.walkers[0].cycle.poses[25 * i + 2]))"
    shown.until("!motionenv.walkers[0].asking")
    high = shown.ask(bouncy)
    shown.page.keyboard.press("Home")
    shown.until("!motionenv.walkers[0].asking && motionenv.one.deviations.some((d) => d < 0)")
    shown.until(f"{bouncy} !== {high}")
    assert shown.ask("motionenv.walkers[0].speed") == pytest.approx(1.32), "style doesn't change speed"


def test_who_wants_no_motion_gets_none(browser, server):
    calm = tab(browser, server.url).open("model=walk/fpca")
    assert calm.ask("motionenv.paused") is True
    calm.page.click("#pause")
    calm.until("motionenv.cycles[0] > 0.05")
    calm.page.context.close()


def test_the_page_says_in_plain_words_what_fails(browser, server):
    unlucky = tab(browser, server.url)
    unlucky.open("model=walk/fpca")
    unlucky.page.route("**/v1/**", lambda route: route.abort())
    unlucky.page.click("#models-section summary")
    unlucky.page.click("#models label:nth-of-type(2)")
    unlucky.until("!document.getElementById('note').hidden")
    assert "doesn't answer" in unlucky.page.text_content("#note")
    unlucky.page.click("[data-suffix=npz]")
    unlucky.until("document.getElementById('download-note').textContent.includes(\"doesn't answer\")")
    unlucky.picture("trouble")
    assert unlucky.ask("motionenv.state.model") == "walk/fpca", "what is shown goes on"
    unlucky.page.unroute("**/v1/**")
    unlucky.page.click("#models label:nth-of-type(2)")
    unlucky.until("motionenv.parameters.kind === 'eigenwalkers' && document.getElementById('note').hidden")
    unlucky.page.goto("about:blank")
    unlucky.page.goto(f"{server.url}/#model=fitted/nobody")
    unlucky.until("document.getElementById('note')?.textContent.includes('no model')")
    unlucky.page.context.close()


def test_a_busy_service_is_waited_for(browser, server):
    patient, refused = tab(browser, server.url), []

    def busy(route):
        if len(refused) < 2:
            refused.append(1)
            route.fulfill(status=503, headers={"Retry-After": "1"}, body='{"detail": "being made"}')
        else:
            route.continue_()

    patient.page.route("**/parameters", busy)
    patient.open("model=walk/fpca")
    assert len(refused) == 2
    patient.page.context.close()


def test_without_webgl_it_says_so(browser, server):
    blind = tab(browser, server.url)
    blind.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    blind.page.goto(server.url)
    blind.until("!document.getElementById('note').hidden")
    assert "WebGL" in blind.page.text_content("#note")
    blind.page.context.close()


def test_a_key_that_the_browser_asks_for_opens_everything(browser, locked):
    """Basic, with the key as the password: the page, its files, its requests and its stream."""
    basic = {"username": "anybody", "password": locked.key}
    keyed = tab(browser, locked.url, walking=True, http_credentials=basic)
    keyed.open("model=walk/fpca")
    keyed.page.click("#models-section summary")
    keyed.page.click("#models label:nth-of-type(3)")
    keyed.until("motionenv.walkers[0]?.ground[0] > 0.1", 90)
    assert keyed.complaints == []
    keyed.page.context.close()


@pytest.fixture(scope="module")
def walk_file(tmp_path_factory):
    """A walk of some strides that the model has never seen; its head is seen a little later than the rest."""
    path = tmp_path_factory.mktemp("capture") / "me_01.npz"
    walk = motionenv.synthesize("walk/fpca", 14, 60, seed=11, speed=1.2)
    poses = walk.poses.copy()
    poses[:5, POSE.index("neck_flexion") : POSE.index("neck_rotation") + 1] = np.nan
    motionenv.write(replace(walk, poses=poses), path)
    return path


@pytest.mark.slow
def test_a_capture_is_shown_and_cut_and_has_the_panel_to_itself(shown, server, walk_file):
    shown.open("model=walk/fpca")
    shown.page.set_input_files("#capture-panel input[type=file]", walk_file)
    shown.until("document.querySelector('.found')?.textContent.includes('strides')", 60)
    found = shown.page.text_content(".found")
    assert "me_01.npz" in found
    assert "840 frames at 60/s" in found
    shown.until("motionenv.guest", 10)
    shown.still(0.5)
    head = shown.ask("Array.from(motionenv.stage.figures[0].limbs[0].geometry.attributes.position.array)")
    assert None not in head
    assert min(shown.ask("motionenv.guest.limbs").__getitem__(slice(62, 66, 3))) > -0.05
    shown.picture("capture-found")
    shown.until("document.querySelectorAll('.steps .done').length === 3", 120)
    assert shown.page.text_content("#subject-title") == "Your capture: me_01.npz"
    assert "m/s" in shown.page.text_content("#subject-facts")
    assert not shown.page.is_visible("#randomise"), "one subject at a time"
    assert not shown.page.is_visible("#traits")
    shown.picture("capture-read")
    assert "me-01" not in server.http.get("/v1/models").text, "nobody asked for a model"


@pytest.mark.slow
def test_a_model_is_fitted_for_who_asks_and_goes_with_the_files(shown, server, walk_file):
    shown.open("model=walk/fpca")
    fitted = "document.querySelectorAll('#models input[value^=\"fitted/me-01\"]').length"
    shown.page.set_input_files("#capture-panel input[type=file]", walk_file)
    shown.page.click("text=Make a model of it", timeout=120_000)
    shown.page.click("text=Use model", timeout=120_000)
    shown.until("motionenv.state.model.startsWith('fitted/me-01') && motionenv.guest === null", 30)
    least, most = shown.ask("motionenv.parameters.learned_speeds")
    assert least * 0.99 <= shown.ask("motionenv.walkers[0].speed") <= most * 1.01, "its own pace"
    assert shown.ask("motionenv.walkers[0].speed") == pytest.approx(1.2, abs=0.05)
    slider = shown.page.locator("#pace .slider")
    assert "extrapolated" not in slider.inner_text()
    low, high = (float(slider.locator("input").get_attribute(end)) for end in ("min", "max"))
    assert 0.3 < low < least
    assert most < high < 2.6
    shown.until(f"{fitted} === 1")
    assert shown.page.text_content("#subject-title") == "Model: me-01"
    assert shown.page.is_visible("#traits")
    assert "me-01" not in server.http.get("/v1/models").text, "it is the visitor's own"
    name = shown.ask("motionenv.state.model")
    assert server.http.get(f"/v1/models/{name}").status_code == 200, "for who knows its name"
    shown.page.click("text=Forget the files")
    shown.until("motionenv.state.model === 'walk/fpca'")
    shown.until(f"{fitted} === 0")
    assert shown.page.is_disabled("#undo"), "who is forgotten doesn't come back"
    assert server.http.get(f"/v1/models/{name}").status_code == 404
    assert shown.complaints == []


def test_files_dropped_meanwhile_wait_and_each_says_how_it_fares(browser, server, tmp_path):
    files = [tmp_path / name for name in ("walk0.npz", "walk1.npz", "walk2.bvh")]
    for seed, path in enumerate(files[:2]):
        motionenv.write(motionenv.synthesize("walk/fpca", 4, 60, seed=seed, height=1.6 + 0.1 * seed), path)
    files[2].write_text("these are not the joints that you are looking for")
    seen = tab(browser, server.url).open("model=walk/fpca")
    for path in files:
        seen.page.set_input_files("#capture-panel input[type=file]", path)
    states = "[...document.querySelectorAll('.queue li')].map((row) => row.textContent)"
    assert [told.partition(":")[0] for told in seen.ask(states)] == [path.name for path in files]
    seen.until(f"{states}.every((told) => !/waiting|being read/.test(told))", 120)
    assert seen.ask(states) == ["walk0.npz: read", "walk1.npz: read", "walk2.bvh: not readable"]
    seen.page.click(".queue li:nth-child(1) button")
    seen.until("motionenv.guest?.name === 'walk0.npz'")
    assert seen.page.text_content("#subject-title") == "Your capture: walk0.npz"
    seen.page.click("#leave")
    assert seen.ask("motionenv.guest") is None
    assert seen.page.is_visible("#randomise")
    assert seen.complaints == []


def test_fields_say_what_they_take_and_replace_nothing(shown):
    shown.open("model=walk/fpca&seed=7&drawn=1")
    for field, odd in (("seed", "-5"), ("seed", "1.5"), ("seconds", "0"), ("seconds", "-3"), ("seconds", "1000")):
        shown.page.fill(f"#{field}", odd)
        shown.page.keyboard.press("Tab")
        assert shown.page.input_value(f"#{field}") == odd
        assert shown.page.get_attribute(f"#{field}", "aria-invalid") == "true"
        assert "number from" in shown.page.text_content(f"#wrong-{field}")
        assert shown.ask("motionenv.one.seed") == 7
    shown.page.click("#downloads button")
    assert shown.ask("document.activeElement.id") == "seconds"
    shown.page.fill("#seconds", "2.5")
    assert shown.page.locator("#wrong-seconds").count() == 0


def test_one_undo_takes_back_one_thing(shown):
    shown.open("model=walk/fpca")
    slider = "document.querySelector('#traits input')"
    shown.ask(f"{{ {slider}.value = 2; {slider}.dispatchEvent(new Event('input')); }}")
    for button in ("#reset", "#randomise"):
        shown.page.click(button)
        shown.until(f"{slider}.value !== '2'")
        shown.page.click("#undo")
        shown.until(f"{slider}.value === '2'")


def test_whom_to_draw_from_holds_for_both_and_draws_at_once(shown):
    shown.open("model=walk/fpca")
    shown.page.click("#compare")
    shown.page.select_option("#who", "woman")
    assert shown.ask("[motionenv.one.who, motionenv.one.drawn, motionenv.state.chosen]") == ["woman", True, 1]
    shown.page.check("#chosen input[value='0']", force=True)
    shown.page.click("#randomise")
    assert shown.ask("motionenv.state.people.map((one) => one.who)") == ["woman", "woman"]


def test_back_and_forward_go_through_what_was_seen(shown):
    shown.open("model=walk/fpca")
    seen = []
    for seed in (3, 4):
        shown.page.evaluate("(seed) => motionenv.draw(seed)", seed)
        shown.until(f"location.hash.includes('seed={seed}')")
        seen.append(shown.page.url)
    shown.page.go_back()
    shown.until("motionenv.one.seed === 3 && motionenv.one.drawn")
    assert shown.page.url == seen[0]
    shown.page.go_forward()
    shown.until("motionenv.one.seed === 4")
    assert shown.page.url == seen[1]


def test_a_slow_line_shows_somebody_before_the_script_comes(browser, server):
    """At 400 kbit/s: the poster is in the page itself, which is under 20 kB; buttons wait until they work."""
    slow = tab(browser, server.url)
    held = []
    slow.page.route("**/assets/main-*.js", lambda route: held.append(route))
    slow.page.goto(server.url, wait_until="commit")
    slow.until("document.getElementById('poster')?.complete && document.getElementById('poster').naturalWidth > 0")
    size = len(server.http.get("/").content) + len(server.http.get("/", headers={"Accept-Encoding": "gzip"}).content)
    assert size < 2 * 20_000
    slow.picture("slow-line")
    assert slow.page.is_visible("#loading")
    assert slow.ask("document.getElementById('controls').inert")
    while not held:
        slow.page.wait_for_timeout(20)
    held[0].continue_()
    slow.until("globalThis.motionenv?.stats.frames > 0 && document.getElementById('loading').hidden", 60)
    assert not slow.page.is_visible("#poster")
    assert not slow.ask("document.querySelector('[inert]') !== null")
    slow.page.context.close()


def test_a_file_that_is_no_capture_is_told_so(shown, tmp_path):
    bad = tmp_path / "holiday.bvh"
    bad.write_text("these are not the joints that you are looking for")
    shown.open("model=walk/fpca")
    shown.page.set_input_files("#capture-panel input[type=file]", bad)
    shown.until("document.querySelector('#capture .hint.bad')", 60)
    assert "holiday.bvh" in shown.page.text_content("#capture")
    shown.picture("capture-refused")


def test_amc_is_asked_for_its_frame_rate_before_it_is_sent(shown, tmp_path):
    for name in ("07.asf", "07_01.amc"):
        (tmp_path / name).write_text(":FULLY-SPECIFIED")
    shown.open("model=walk/fpca")
    shown.page.set_input_files("#capture-panel input[type=file]", [tmp_path / "07.asf", tmp_path / "07_01.amc"])
    shown.until("document.querySelector('#capture .hint.bad')")
    assert "frames per second" in shown.page.text_content("#capture .hint.bad")
    assert shown.ask("document.activeElement.placeholder") == "as in the file"
    shown.page.fill("#capture input[type=number]", "120")
    shown.page.click("text=Read the files again")  # they need not be chosen once more
    shown.until("document.querySelector('.found')?.textContent.includes('07_01.amc')", 60)


@pytest.mark.slow
def test_files_are_forgotten_when_asked(browser, server, tmp_path):
    name = "a-very-long-name-without-a-blank-" * 5
    motionenv.write(motionenv.synthesize("walk/fpca", 4, 60, seed=9), tmp_path / f"{name}.c3d")
    seen = tab(browser, server.url, PHONE).open("model=walk/fpca")
    seen.page.set_input_files("#capture-panel input[type=file]", tmp_path / f"{name}.c3d")
    seen.until("document.querySelectorAll('.steps .done').length === 3", 120)
    seen.page.click("text=Make a model of it")
    seen.page.locator("text=Use model").wait_for(timeout=120_000)
    assert seen.ask("document.documentElement.scrollWidth") <= PHONE[0]
    jobs = seen.ask("motionenv.guest && Array.from(document.querySelectorAll('.found li')).length")
    assert jobs == 1
    assert not any(name[:40] in str(job) for job in server.http.get("/v1/jobs").json()["jobs"]), "it is in no list"
    kept = lambda: {path for path in server.data.rglob("*") if path.is_file() and path.suffix != ".sqlite-wal"}
    before = kept()
    seen.page.click("text=Forget the files")
    seen.until("document.querySelector('#capture').textContent.includes('Forgotten')")
    gone = before - kept()
    assert any(path.parent.name == "models" for path in gone)
    assert not any(name[:20] in path.name for path in kept())
    assert not any(name.encode() in path.read_bytes() for path in kept()), "nothing of it stays on disk"
    assert seen.ask("motionenv.guest") is None
    assert seen.complaints == []


@pytest.mark.slow
def test_an_axis_between_two_groups_becomes_a_slider(browser, server, tmp_path):
    files = []
    for i in range(4):
        walk = motionenv.synthesize("walk/fpca", 5, 60, seed=20 + i, speed=1.0 if i < 2 else 1.6)
        files.append(tmp_path / f"who{i}_1.npz")
        motionenv.write(walk, files[-1])
    seen = tab(browser, server.url).open("model=walk/fpca")
    seen.page.set_input_files("#capture-panel input[type=file]", files)
    seen.page.click("text=Make a model of it", timeout=120_000)
    seen.page.click("text=An axis between two groups of people")
    seen.page.fill("[aria-label='Name of the first group']", "Strollers")
    seen.page.fill("[aria-label='Name of the second group']", "Hurried")
    seen.page.click("text=Fit with this axis")
    seen.until("document.querySelector('#capture').textContent.includes('of 2 Strollers')", 120)
    seen.picture("axis")
    seen.page.click("text=Use model")
    seen.until("motionenv.state.model.startsWith('fitted/who0') && motionenv.guest === null", 30)
    slider = seen.page.locator("#traits .slider").first
    assert "Strollers" in slider.inner_text()
    assert "Left out of the fit" in slider.get_attribute("title")
    seen.page.click("text=Forget the files")
    seen.until("motionenv.state.model === 'walk/fpca'")
    assert seen.complaints == []


@pytest.mark.slow
def test_a_link_shows_a_capture_while_it_is_kept(browser, server, tmp_path):
    motionenv.write(motionenv.synthesize("walk/fpca", 4, 60, seed=11, height=1.6), tmp_path / "linked.c3d")
    seen = tab(browser, server.url).open("model=walk/fpca")
    seen.page.set_input_files("#capture-panel input[type=file]", tmp_path / "linked.c3d")
    seen.until("location.hash.includes('capture=')", 120)
    link = seen.page.evaluate("() => location.hash.slice(1)")
    other = tab(browser, server.url).open(link)
    other.until("motionenv.guest", 30)
    assert other.ask("motionenv.guest.body.height") == pytest.approx(seen.ask("motionenv.guest.body.height"))
    other.page.click("#leave")
    other.until("motionenv.guest === null && !location.hash.includes('capture')")
    seen.page.click("text=Forget the files")
    seen.until("document.querySelector('#capture').textContent.includes('Forgotten')")
    gone = tab(browser, server.url).open(link)
    gone.until("document.getElementById('note').textContent.includes('any more')")
    assert gone.ask("motionenv.guest") is None
