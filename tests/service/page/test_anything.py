"""Whatever somebody does to the page, in whatever order, somebody walks and nothing says NaN.

Actions at random, thousands with -m benchmark: sliders to any place, buttons, models, links that are true, odd or
nonsense.
"""

import re

import numpy as np
import pytest

from tests.service.page.browsing import tab

MODELS = ("walk/fpca", "walk/eigenwalkers", "walk/prior", "mixed/tree")
ODD = ("", "NaN", "Infinity", "-1e308", "1e999", "x", ",,,", "-0", "\u0000", "0x10", "9" * 400)

#: Does an action [kind, number] in the page; returns after the next frame, with what is wrong.
ACT = """async ([kind, number, text]) => {
  const app = globalThis.motionenv;
  const BUTTONS = "#randomise, #reset, #compare, #pause, #undo, #redo, .lock, [data-view], .own, #chosen input";
  const pick = (selector) => {
    const all = [...document.querySelectorAll(selector)].filter((e) => !e.disabled && e.offsetParent !== null);
    return all[Math.floor(number * all.length)];
  };
  if (kind === "slide") {
    const input = pick("input[type=range]");
    if (input) {
      const share = (number * 7919) % 1;
      input.value = Number(input.min) + share * (input.max - input.min);
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }
  } else if (kind === "end") {
    const input = pick("input[type=range]");
    if (input) {
      input.value = (number * 7919) % 1 < 0.5 ? input.min : input.max;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }
  } else if (kind === "press") pick(BUTTONS)?.click();
  else if (kind === "choose") pick("input[name=model], #figure input, input[type=checkbox]")?.click();
  else if (kind === "seed") {
    document.getElementById("seed").value = text;
    document.getElementById("seed").dispatchEvent(new Event("change", { bubbles: true }));
  } else if (kind === "link") {
    const before = location.hash;
    const followed = new Promise((done) => addEventListener("hashchange", done, { once: true }));
    location.hash = text;
    if (location.hash !== before) await followed; // the event comes later
  }
  for (let wait = 0; wait < 4800 && (app.wanted !== app.state.model || !app.shown); wait++) {
    await new Promise((done) => setTimeout(done, 25));
  }
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const wrong = [];
  const told = document.getElementById("note").textContent;
  if (app.wanted !== app.state.model) wrong.push(`${app.wanted} never came: ${told}`);
  const said = [document.body.innerText, ...[...document.querySelectorAll("output, [aria-valuetext]")].map((e) =>
    `${e.textContent} ${e.getAttribute("aria-valuetext") ?? ""}`)].join(" ");
  const odd = said.match(/NaN|Infinity|undefined|\\[object/);
  if (odd) wrong.push(`it says ${odd[0]}`);
  if (app.stage.figures.length !== app.walkers.length || !app.walkers.length) wrong.push("nobody is on the stage");
  for (const walker of app.walkers) {
    if (walker.cyclic && !walker.limbs.every(Number.isFinite)) wrong.push("limbs are nowhere");
    if (!Number.isFinite(walker.body.height)) wrong.push("a body has no height");
  }
  if (!app.stage.view.every(Number.isFinite)) wrong.push("the camera is nowhere");
  return wrong;
}"""


def link(rng: np.random.Generator) -> str:
    """A link: any model, any number of deviations, now and then nonsense."""
    word = lambda: ODD[rng.integers(len(ODD))] if rng.random() < 0.2 else f"{rng.normal(0, 2):.2f}"
    fields = {
        "model": [*MODELS, "walk/none", "../x"][rng.integers(len(MODELS) + (rng.random() < 0.05) * 2)],
        "walker": ",".join(word() for _ in range(rng.integers(0, 40))),
        "walker2": ",".join(word() for _ in range(rng.integers(0, 12))),
        "held": ",".join(rng.choice(["t0", "c3", "c99", "t-1", "x", "t2"], int(rng.integers(0, 5)))),
        "camera": ",".join(word() for _ in range(rng.integers(1, 5))),
        **{name: word() for name in ("speed", "height", "speed2", "height2", "seed", "temperature", "heading")},
        "figure": ["body", "stick", "points", "ghost"][rng.integers(4)],
    }
    kept = [name for name in fields if name == "model" or rng.random() < 0.4]
    return "&".join(f"{name}={fields[name]}" for name in kept if "\u0000" not in fields[name])


def action(rng: np.random.Generator) -> list:
    kind = rng.choice(["slide", "end", "press", "choose", "seed", "link"], p=[0.4, 0.15, 0.15, 0.15, 0.05, 0.1])
    text = (
        link(rng) if kind == "link" else ODD[rng.integers(len(ODD))] if rng.random() < 0.3 else str(rng.integers(9999))
    )
    return [str(kind), float(rng.random()), text]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "count"), [(0, 100), (1, 100), *(pytest.param(s, 1000, marks=pytest.mark.benchmark) for s in (2, 3, 4))]
)
def test_no_order_of_clicks_and_no_link_shows_nobody(browser, server, seed, count):
    rng, done = np.random.default_rng(seed), []
    shown = tab(browser, server.url).open(link(rng) if seed else "")
    for _ in range(count):
        done.append(action(rng))
        wrong = shown.page.evaluate(ACT, done[-1])
        assert not wrong, (wrong, done[-5:], shown.page.evaluate("() => location.hash"))
        # The browser says itself that "x" is no number, that there is no model walk/none, and that the service refuses
        # a small body that is too fast, which the page's note tells.
        heard = [c for c in shown.complaints if not re.search("cannot be parsed|404|422", c)]
        assert not heard, (heard, done[-5:])
    shown.page.context.close()


@pytest.mark.parametrize(
    "state",
    [
        "model=walk/fpca&walker=1,0,0,0,0,0,0,0,1,1",
        "model=walk/eigenwalkers&walker=" + ",".join(["3"] * 64),
        "model=walk/fpca&walker=NaN,Infinity,-Infinity,1e999&speed=NaN&height=x&camera=1e300,0,0",
    ],
)
def test_a_link_of_too_much_shows_what_the_model_has(browser, server, state):
    shown = tab(browser, server.url).open(state)
    assert shown.page.evaluate(ACT, ["none", 0.0, ""]) == []
    assert shown.ask("motionenv.one.deviations.length <= motionenv.parameters.components")
    shown.page.context.close()


def test_a_link_to_no_model_shows_the_average_walker_and_says_so(browser, server):
    shown = tab(browser, server.url).open("model=walk/none&walker=1,2")
    assert shown.ask("motionenv.state.model") == "walk/fpca"
    assert shown.ask("motionenv.one.deviations") == []
    assert "walk/none" in shown.ask("document.getElementById('note').textContent")
    shown.page.context.close()


def test_a_link_to_somebody_impossible_shows_the_average_walker_and_says_so(browser, server):
    shown = tab(browser, server.url).open("model=walk/prior&speed=2.6&height=1")
    assert shown.ask("[motionenv.state.model, motionenv.one.speed]") == ["walk/fpca", None]
    assert "m/s for a body of 1.00 m" in shown.ask("document.getElementById('note').textContent")
    shown.page.context.close()


def test_who_is_too_fast_for_the_body_is_told(browser, server):
    shown = tab(browser, server.url).open("model=walk/prior")
    shown.page.evaluate("() => { motionenv.one.height = 1; motionenv.one.speed = 2.6; motionenv.change(() => {}); }")
    shown.until("document.getElementById('note').textContent.includes('m/s for a body of 1.00 m')")
    shown.page.evaluate("() => { motionenv.one.speed = 1; motionenv.change(() => {}); }")
    shown.until("document.getElementById('note').hidden")
    shown.page.context.close()


def test_each_model_keeps_its_own_deviations(browser, server):
    shown = tab(browser, server.url).open("model=walk/eigenwalkers&walker=0,1.8,0,0,0,0,0,0,0.5,0.5")
    for name, expected in (("walk/fpca", []), ("walk/eigenwalkers", [0, 1.8, 0, 0, 0, 0, 0, 0, 0.5, 0.5])):
        shown.page.evaluate("(name) => motionenv.load(name)", name)
        shown.until(f"motionenv.state.model === '{name}'")
        assert shown.ask("motionenv.one.deviations") == expected
    shown.page.context.close()


def test_sliders_hold_what_was_set_and_undo_takes_it_back(browser, server):
    shown = tab(browser, server.url).open("model=walk/fpca")
    names = shown.ask("motionenv.parameters.traits.map((t) => t.name).filter((name) => name !== 'pace')")
    wanted = {"arm swing": -2.0, "lean": 2.0, "bounce": 2.0}
    assert set(wanted) <= set(names), names
    put = """([i, value]) => { const input = document.querySelectorAll('#traits input')[i];
        input.value = value; input.dispatchEvent(new Event('input', { bubbles: true })); }"""
    values = lambda: shown.ask("[...document.querySelectorAll('#traits input')].map((input) => input.valueAsNumber)")
    for name, value in wanted.items():
        shown.page.evaluate(put, [names.index(name), value])
        shown.page.wait_for_timeout(700)  # a step of its own
    found = dict(zip(names, values(), strict=True))
    assert {name: found[name] for name in wanted} == pytest.approx(wanted, abs=0.051)
    locks = (
        "[...document.querySelectorAll('#traits .lock')].map((lock) => lock.getAttribute('aria-pressed') === 'true')"
    )
    assert [name for name, on in zip(names, shown.ask(locks), strict=True) if on] == [n for n in names if n in wanted]
    assert shown.ask("motionenv.one.held.length") == 3
    shown.page.click("#undo")
    shown.until("motionenv.one.held.length === 2")
    assert dict(zip(names, values(), strict=True))["arm swing"] == pytest.approx(-2, abs=0.051)
    shown.page.keyboard.press("Control+z")
    shown.until("motionenv.one.held.length === 1")
    shown.page.click("#redo")
    shown.until("motionenv.one.held.length === 2")
    shown.picture("held")
    assert shown.complaints == []
    shown.page.context.close()
