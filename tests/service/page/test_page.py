"""The page in a real browser: walkers walk, sliders work at once, links and downloads hold what was shown."""

import io
import re

import av
import numpy as np
import pygltflib
import pytest
from PIL import Image, ImageChops

import motionenv
from motionenv.models import cycle
from tests.service.page.browsing import DESK, PHONE, tab

MODELS = ["walk/fpca", "walk/eigenwalkers"]
CURVES = {"Hip": (17, 21), "Knee": (20, 24), "Shoulder": (9, 13), "Elbow": (12, 16)}  # columns of POSE


def pixels(png: bytes) -> Image.Image:
    """The stage of a screenshot at the desktop's size."""
    return Image.open(io.BytesIO(png)).convert("RGB").crop((0, 60, 600, 500))


@pytest.mark.parametrize(
    ("model", "scheme"), [("walk/fpca", "light"), ("walk/eigenwalkers", "dark"), ("mixed/tree", "light")]
)
def test_somebody_walks_and_the_console_is_silent(browser, server, model, scheme):
    fresh = tab(browser, server.url, walking=True, color_scheme=scheme).open(f"model={model}")
    before = pixels(fresh.picture(f"{model.replace('/', '-')}-{scheme}"))
    fresh.until("motionenv.cycles[0] > 0.2" if model in MODELS else "motionenv.walkers[0].ground[0] > 0.05", 60)
    after = pixels(fresh.page.screenshot())
    assert ImageChops.difference(before, after).getbbox() is not None
    assert fresh.ask("document.getElementById('note').hidden")
    assert fresh.complaints == []
    fresh.page.context.close()


#: Moves the i-th slider to 1.35, the others let go.
_SLIDE = (
    "{{ document.querySelectorAll('.lock[aria-pressed=true]').forEach((lock) => lock.click());"
    "  const input = document.querySelectorAll('#traits input, #components input')[{i}];"
    "  input.value = 1.35; input.dispatchEvent(new Event('input', {{bubbles: true}})); return input.value; }}"
)
_ARRIVED = "!motionenv.walkers[0].asking"


@pytest.mark.parametrize("model", MODELS)
def test_a_slider_moves_the_pose_as_python_says(shown, model):
    """Deviations after each of the sliders, the others let go, and the cycle that is shown then."""
    shown.open(f"model={model}")
    fitted = motionenv.load(model)
    sliders = shown.ask("document.querySelectorAll('#traits input, #components input').length")
    assert sliders == 6 + (model != "walk/fpca") + len(fitted.components())
    for i in range(sliders):
        value = shown.ask(_SLIDE.format(i=i))
        assert float(value) == pytest.approx(1.35, abs=0.026)
        shown.until(_ARRIVED)
        deviations, stride = shown.ask("[motionenv.one.deviations, motionenv.walkers[0].cycle]")
        want = cycle(fitted, deviations=deviations)
        np.testing.assert_allclose(np.reshape(stride["poses"], (-1, 25)), want.poses, atol=1e-6)
        np.testing.assert_allclose(np.reshape(stride["markers"], (-1, 15, 3)), want.markers, atol=1e-6)
        assert (stride["seconds"], stride["stride"]) == pytest.approx((want.seconds, want.stride), rel=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_nothing_jumps_when_a_slider_moves(shown, model):
    """Dragged or set, it moves no marker by more than 12 cm in a frame, nor the ground faster than 2.6 m/s."""
    shown.open(f"model={model}")
    for slider, frames in (("#traits input", 40), ("#pace input", 40), ("#traits input", 1), ("#pace input", 1)):
        shown.page.evaluate(_WATCH, [slider, frames])
        shown.until("globalThis.watched.done", 60)
        markers, ground = shown.ask("[watched.markers, watched.ground]")
        assert 0.01 < markers < 0.12, (slider, frames)
        assert 0.005 < ground < 2.7 / 60, (slider, frames)
        shown.ask("{ motionenv.reset(); }")
        shown.until(_ARRIVED)


#: Watches 60 frames of 1/60 s while a slider goes from its middle to its end in some frames: the greatest step of any
#: marker, and of the ground, from one frame to the next [m].
_WATCH = """([name, frames]) => {
  const [walker] = motionenv.walkers;
  const input = document.querySelector(name);
  const watched = (globalThis.watched = { markers: 0, ground: 0, done: false });
  let [frame, moment, before] = [0, 0, null];
  motionenv.paused = false;
  motionenv.frame = () => {}; // frames come from here
  const step = () => {
    if (frame >= 5 && frame < 5 + frames) {
      input.value = Number(input.value) + (input.max - input.min) / 2 / frames;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }
    moment = walker.after(moment, 1 / 60);
    walker.show(moment);
    const now = [[...walker.markers], walker.ground[0]];
    if (before) {
      watched.markers = Math.max(watched.markers, ...now[0].map((x, i) => Math.abs(x - before[0][i])));
      watched.ground = Math.max(watched.ground, Math.abs(now[1] - before[1]));
    }
    before = now;
    if (++frame < 60) setTimeout(step, 16);
    else watched.done = true;
  };
  step();
}"""


def test_speed_and_height_are_what_is_asked_for(shown):
    shown.open("model=walk/fpca&speed=1.8&height=1.5")
    assert shown.ask("motionenv.walkers[0].speed") == pytest.approx(1.8)
    assert shown.ask("motionenv.walkers[0].body.height") == 1.5
    assert "1.80 m/s" in shown.page.text_content("#facts")
    assert shown.page.text_content("#pace .slider:nth-child(1) output") == "1.80 m/s, extrapolated"
    shown.page.click("#pace .slider:nth-child(1) .own")
    assert shown.ask("motionenv.one.speed") is None
    shown.until(_ARRIVED)
    assert shown.ask("motionenv.walkers[0].speed") == pytest.approx(1.32)


def test_each_look_is_another_picture(shown):
    """Body, stick, dots, with lines, upside down, scrambled: at one moment of one walk."""
    looks = ["figure=body", "figure=stick", "figure=points", "figure=points&lines=1", "figure=points&inverted=1",
             "figure=points&scattered=1", "figure=points&hiding=1"]  # fmt: skip
    pictures = []
    for look in looks:
        shown.open(f"model=walk/fpca&camera=0,8,5.6&{look}").still()
        pictures.append(pixels(shown.picture(look.replace("&", "-"))))
    for i, one in enumerate(pictures):
        assert max(high for _, high in one.getextrema()) > 120, looks[i]
        assert all(ImageChops.difference(one, other).getbbox() for other in pictures[:i]), looks[i]
    lights = [np.asarray(p).mean(axis=2) > 128 for p in pictures]
    assert lights[6].sum() < 0.9 * lights[2].sum(), "from the side, the body hides points of the far side"
    upright, inverted = (np.flatnonzero(lights[i].any(axis=1)) for i in (2, 4))
    assert np.ptp(upright) == pytest.approx(np.ptp(inverted), abs=12)


def test_a_link_brings_everything_back(shown, browser, server):
    shown.open("model=walk/eigenwalkers&figure=stick&walker=1.2,-0.4&walker2=-1,0.5,2&speed2=1.5&camera=20,15,6")
    shown.until("location.hash.includes('walker2=-1,0.5,2')")
    other = tab(browser, server.url).open(shown.page.url.split("#")[1])
    for each in (shown, other):
        each.until("document.querySelector('#models input[value=\"walk/prior\"]')")  # listed by the service
        each.still()  # only now: what is listed late moves the stage, which is then drawn again
    assert other.ask("motionenv.state") == shown.ask("motionenv.state")
    difference = ImageChops.difference(pixels(shown.picture("link")), pixels(other.page.screenshot()))
    assert np.asarray(difference).mean() < 0.1
    other.page.context.close()


def test_two_walkers_side_by_side(shown):
    shown.open("model=walk/fpca")
    shown.page.click("#compare")
    assert shown.ask("motionenv.walkers.length") == 2
    assert shown.ask("motionenv.state.people[0].deviations.some((d) => d !== 0)") is False
    assert shown.ask("motionenv.state.people[1].drawn") is True
    shown.still()
    picture = pixels(shown.picture("compare"))
    assert ImageChops.difference(picture.crop((0, 0, 300, 440)), picture.crop((300, 0, 600, 440))).getbbox()
    shown.page.check("#together")
    shown.page.click("#pause")
    shown.until("motionenv.cycles[0] > 1.5", 30)
    assert len(set(shown.ask("motionenv.cycles"))) == 1
    assert len(set(shown.ask("motionenv.walkers.map((walker) => walker.seconds)"))) == 2
    shown.page.click("#compare")
    assert shown.ask("motionenv.walkers.length") == 1


@pytest.mark.parametrize("model", MODELS)
def test_the_seed_says_who_comes(shown, server, model):
    """The same person as in Python and over HTTP, until a slider moves; then somebody of her pace, size and style."""

    def is_drawn(seed: int) -> None:
        shown.until(_ARRIVED)
        stride, want = shown.ask("motionenv.walkers[0].cycle"), cycle(fitted, walker=fitted.walker(seed))
        np.testing.assert_allclose(np.reshape(stride["poses"], (-1, 25)), want.poses, atol=1e-6)
        assert stride["height"] == pytest.approx(want.body.height, rel=1e-6)
        assert shown.ask("motionenv.one.drawn")

    fitted = motionenv.load(model)
    shown.open(f"model={model}")
    for seed in (17, 18):
        shown.ask(f"{{ motionenv.draw({seed}); }}")
        is_drawn(seed)
    walk = server.http.post("/v1/synthesis", json={"model": model, "seed": 18, "seconds": 1}).json()
    assert walk["height"] == pytest.approx(shown.ask("motionenv.walkers[0].cycle.height"), rel=1e-6)
    shown.page.fill("#seed", "17")
    shown.ask("{ motionenv.refresh(); }")  # as when a stride arrives
    shown.page.press("#seed", "Enter")
    is_drawn(17)
    shown.ask("location.hash.includes('drawn=1')")
    before = shown.ask("motionenv.walkers[0].cycle")
    shown.ask(_SLIDE.format(i=0))
    shown.until(_ARRIVED)
    after = shown.ask("motionenv.walkers[0].cycle")
    assert not shown.ask("motionenv.one.drawn")
    assert after["height"] == pytest.approx(before["height"], abs=0.006)
    assert after["stride"] / after["seconds"] == pytest.approx(before["stride"] / before["seconds"], abs=0.006)


def test_the_tree_is_steered_while_it_moves(shown):
    shown.open("model=mixed/tree")
    shown.until("motionenv.walkers[0].end > 0.5", 60)
    shown.page.focus("#pace input")
    for _ in range(6):
        shown.page.keyboard.press("ArrowRight")
    assert shown.ask("motionenv.walkers[0].stream.settings.temperature") == pytest.approx(0.1, rel=0.1)
    x, y = shown.ask("[...motionenv.walkers[0].ground].slice(0, 2)")  # it may stand for a while, or turn
    shown.until(f"Math.hypot(motionenv.walkers[0].ground[0] - {x}, motionenv.walkers[0].ground[1] - {y}) > 0.05", 60)
    assert shown.ask("document.getElementById('note').hidden")


def test_what_a_tree_has_grown_is_scrubbed_through_and_downloaded(shown, tmp_path):
    """A pause changes nothing of what is grown: it is the motion that the service makes of the same settings."""
    press = shown.page.keyboard.press
    shown.open("model=mixed/tree&seed=5&temperature=0.1&heading=30&activity=walk")
    shown.until("motionenv.walkers[0].end > 1", 60)
    press(" ")
    shown.until("motionenv.walkers[0].stream.settings.paused && !motionenv.walkers[0].stream.sending")
    shown.page.focus("#scrub")
    press("Home")
    shown.until("document.querySelector('#facts').textContent.includes('· 0.0 s of ')")
    assert shown.ask("motionenv.cycles[0]") == 0
    for _ in range(60):
        press("ArrowRight")
    moment, end = shown.ask("[motionenv.cycles[0], motionenv.walkers[0].end]")
    assert moment == pytest.approx(0.3 * end, abs=0.04)
    press(" ")
    shown.until(f"motionenv.cycles[0] > {moment} + 0.2 && motionenv.walkers[0].end > {end} + 0.4", 60)
    with shown.page.expect_download(timeout=30_000) as coming:
        shown.page.click("[data-suffix=npz]")
    coming.value.save_as(tmp_path / "tree.npz")
    grown = np.array(shown.ask("motionenv.walkers[0].poses"))[:120]
    np.testing.assert_allclose(grown, motionenv.read(tmp_path / "tree.npz").poses[: len(grown)], atol=1e-5)
    assert shown.ask("document.getElementById('note').hidden"), "a pause is no trouble"


def test_two_trees_side_by_side(shown):
    shown.open("model=mixed/tree&temperature=0.2&seed=3")
    shown.page.keyboard.press("c")
    assert shown.ask("motionenv.walkers.length") == 2
    shown.page.focus("#pace .slider:nth-child(3) input")
    shown.page.keyboard.press("End")
    shown.page.select_option("#pace select", "turn left")
    told = shown.ask("motionenv.walkers.map(({stream: {settings: t}}) => [t.seed, t.temperature, t.speed, t.activity])")
    assert told == [[3, 0.2, None, None], [4, 0.2, 2.6, "turn left"]]
    shown.until("motionenv.cycles[0] > 0.7", 60)
    first, second = shown.ask("motionenv.cycles")
    assert first == second, "they are shown at one moment"
    assert re.fullmatch(r"(A|B)\d\.\d\d m/s · .*", shown.page.text_content("#names p:nth-child(2)"))
    second = "walker2=&drawn2=1&speed2=2.6&activity2=turn+left&temperature2=0.2&seed2=4"
    shown.until(f"location.hash === '#model=mixed/tree&temperature=0.2&seed=3&{second}'")
    shown.still(0.9)
    picture = pixels(shown.picture("compare-trees"))
    assert ImageChops.difference(picture.crop((0, 0, 300, 440)), picture.crop((300, 0, 600, 440))).getbbox()


@pytest.fixture
def downloaded(shown, tmp_path):
    """`downloaded(suffix)`: the file that a button gives of a walk that is shown."""
    shown.open("model=walk/fpca&walker=1.5,-1&speed=1.4&camera=0,8,5.6")

    def get(suffix: str):
        with shown.page.expect_download(timeout=30_000) as coming:
            shown.page.click(f"[data-suffix={suffix}]")
        words = shown.ask("motionenv.parameters.traits.flatMap((trait) => [trait.low, trait.high])")
        name = coming.value.suggested_filename
        assert re.fullmatch(rf"motionenv-[a-z-]+\.{suffix}", name)
        assert any(word.replace(" ", "-") in name for word in words), "what was set"
        assert ("side" in name) == (suffix == "mp4")
        coming.value.save_as(tmp_path / f"walk.{suffix}")
        shown.until("document.getElementById('download-note').textContent.startsWith('Saved')")
        return tmp_path / f"walk.{suffix}"

    return get


def test_a_download_moves_as_what_is_shown(shown, downloaded):
    motion = motionenv.read(downloaded("npz"))
    assert motion.poses.shape == (120, 25)
    way = motion.poses[-1, 0] - motion.poses[0, 0]
    assert way * motion.fps / 119 == pytest.approx(1.4, abs=0.05)
    for joint, columns in CURVES.items():
        for side, column in enumerate(columns):
            want = np.degrees(motion.poses[:, column])
            cycle = np.array(shown.ask(f"motionenv.walkers[0].curves.{joint}[{side}]"))
            assert cycle.min() == pytest.approx(want.min(), abs=2.5), (joint, side)
            assert cycle.max() == pytest.approx(want.max(), abs=2.5), (joint, side)


@pytest.mark.slow
def test_downloads_are_read_by_what_they_are_for(downloaded):
    assert motionenv.read(downloaded("bvh")).positions.shape[0] == 120
    model = pygltflib.GLTF2().load(downloaded("glb"))
    assert len(model.animations) == 1
    with av.open(downloaded("mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == 120


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "state"),
    [(PHONE, "figure=points&lines=1"), (PHONE, "walker=1&walker2=-1"), ((768, 1024), ""), (DESK, "walker=1&walker2=2")],
)
def test_nothing_is_wider_than_the_screen(browser, server, size, state):
    small = tab(browser, server.url, size).open(f"model=walk/eigenwalkers&{state}")
    small.ask("{ document.querySelectorAll('details').forEach((d) => (d.open = true)); }")
    assert small.ask("document.documentElement.scrollWidth") <= size[0]
    outside = small.ask(
        "[...document.querySelectorAll('button, input, h2, p, output')].filter((e) => {"
        f" const b = e.getBoundingClientRect(); return b.width > 1 && (b.right > {size[0]} + 0.5 || b.left < -0.5);"
        "}).map((e) => e.outerHTML)"
    )
    assert outside == []
    small.picture(f"{size[0]}-{state or 'body'}")
    small.page.context.close()
