"""What the camera sees besides the body: determinism, occlusion, light, noise, and that photographs look like some."""

import math
import pickle

import numpy as np
import pytest
from PIL import Image

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.render.cameras import look_at
from motionenv.render.raycast.multi_body import MultiBodyRaycaster
from motionenv.render.sensors._procedural_backgrounds import photograph, sprites
from motionenv.render.sensors._sensor_kernel import FAR
from motionenv.render.sensors.augmentation import Augmentation, Augmenter
from motionenv.types import Frame

SIZE = 48
FULL = Augmentation("clutter", distractors=3, occluders=2, noise=5.0, brightness=0.3)


@pytest.fixture(scope="module")
def bodies(walking):
    """Makes pictures of n people on black."""
    skeleton, camera = from_height(1.75), look_at((0, -4.5, 1.1), (0, 0, 0.9), width=SIZE, height=SIZE)

    def draw(n: int, *, rgb: bool = True, blank: bool = False) -> Frame:
        same = [np.broadcast_to(a, (n, *np.shape(a))) for a in (skeleton.offsets, skeleton.radii, skeleton.height)]
        view = [
            np.broadcast_to(a, (n, *a.shape)) for a in (camera.K, camera.R, camera.t + np.array([50 * blank, 0, 0]))
        ]
        return MultiBodyRaycaster(SIZE, SIZE).render(walking(n), *same, np.full((n, 5, 3), 0.5), *view, rgb=rgb)

    return draw


def scenery(choice=FULL, n=1, seeds=None, **more) -> Augmenter:
    made = Augmenter(choice, n, SIZE, SIZE, **more)
    for i, seed in enumerate(range(n) if seeds is None else seeds):
        made.begin(i, np.random.default_rng(seed))
    return made


def compose(made: Augmenter, frame: Frame, time=0.0, pan=0.0, slots=None) -> Frame:
    m = len(frame.depth)
    slots = np.arange(m) if slots is None else slots
    return made.compose(frame, np.broadcast_to(time, m), np.broadcast_to(pan, m), slots)


def same(a: Frame, b: Frame) -> None:
    np.testing.assert_array_equal(a.depth, b.depth)
    np.testing.assert_array_equal(a.limbs, b.limbs)
    np.testing.assert_array_equal(a.rgb, b.rgb)


def test_pictures_do_not_depend_on_threads_slots_or_neighbours(bodies):
    time, pan = np.arange(24) * 3.0, np.linspace(-90, 200, 24)
    whole = scenery(n=24).compose(bodies(24), time, pan, np.arange(24))
    same(whole, scenery(n=24, threads=3).compose(bodies(24), time, pan, np.arange(24)))
    order = np.random.default_rng(0).permutation(24)
    moved = scenery(n=24, seeds=order)  # episode order[i] sits in slot i
    picked = Frame(*(getattr(bodies(24), name)[order] for name in ("rgb", "depth", "limbs")))
    moved.compose(picked, time[order], pan[order], np.arange(24))
    same(Frame(whole.rgb[order], whole.depth[order], whole.limbs[order]), picked)
    alone = scenery(n=1, seeds=[7])
    single = alone.compose(
        Frame(*(getattr(bodies(24), k)[7:8] for k in ("rgb", "depth", "limbs"))), time[7:8], pan[7:8], [0]
    )
    np.testing.assert_array_equal(single.rgb[0], whole.rgb[7])


def test_an_episode_begins_anew_with_its_generator(bodies):
    made = scenery(n=2, seeds=[5, 6])
    first = compose(made, bodies(2))
    made.begin(1, np.random.default_rng(5))
    again = compose(made, bodies(2))
    same(Frame(first.rgb[:1], first.depth[:1], first.limbs[:1]), Frame(again.rgb[:1], again.depth[:1], again.limbs[:1]))
    assert (first.rgb[1] != again.rgb[1]).mean() > 0.5


def test_own_photographs_fill_the_picture_and_pan_without_end(bodies, tmp_path):
    wide = np.tile(np.arange(200, dtype=np.uint8)[None, :, None], (50, 1, 3))  # darker on the left
    Image.fromarray(wide).save(tmp_path / "wide.png")
    choice = Augmentation(str(tmp_path))
    made = scenery(choice)
    pans = range(2 * SIZE + 1)
    pictures = [compose(made, bodies(1, blank=True), pan=float(pan)).rgb[0].astype(int) for pan in pans]
    np.testing.assert_array_equal(pictures[0], pictures[2 * SIZE])
    np.testing.assert_array_equal(pictures[0][:, 7:], pictures[7][:, :-7])
    assert np.ptp(pictures[0], axis=0).max() <= 2  # columns are even, as in the photograph
    assert np.abs(np.diff(pictures[0][0, :, 0])).max() <= 6  # no seam where the mirror image begins
    (tmp_path / "broken.png").write_bytes(b"no picture")
    with pytest.raises(MotionError, match=r"broken\.png can't be read as a photograph"):
        scenery(choice, n=8)


@pytest.mark.parametrize("background", ["plain", "clutter"])
def test_the_body_stands_before_the_backdrop(background, bodies):
    drawn, bare = bodies(6), bodies(6)
    composed = compose(scenery(Augmentation(background), n=6), drawn)
    assert composed is drawn
    body = bare.limbs > 0
    np.testing.assert_array_equal(composed.rgb[body], bare.rgb[body])
    np.testing.assert_array_equal(composed.limbs, bare.limbs)
    np.testing.assert_array_equal(composed.depth[body], bare.depth[body])
    assert (composed.depth[~body] == FAR).all()
    assert (composed.rgb[~body] > 0).mean() > 0.95


def test_plain_backdrops_are_even_and_differ(bodies):
    pictures = compose(scenery(Augmentation(), n=40), bodies(40, blank=True)).rgb.astype(int)
    assert not np.ptp(pictures, axis=2).any()  # along rows
    assert np.abs(np.diff(pictures, axis=1)).max() <= 2
    assert np.ptp(pictures, axis=1).max() <= 31
    middle = pictures[:, SIZE // 2, 0]
    assert len(np.unique(middle, axis=0)) == 40
    assert middle.std(0).min() > 25


def test_occluders_hide_the_body_and_nothing_else(bodies):
    choice = Augmentation(occluders=2)
    bare = bodies(40)
    with_them = compose(scenery(choice, n=40), bodies(40))
    hidden = (bare.limbs > 0) & (with_them.limbs == 0)
    assert 0.02 < hidden.sum() / (bare.limbs > 0).sum() < 0.8
    assert (with_them.depth[hidden] < bare.depth[hidden]).all()
    seen = with_them.limbs > 0
    np.testing.assert_array_equal(with_them.limbs[seen], bare.limbs[seen])
    np.testing.assert_array_equal(with_them.depth[seen], bare.depth[seen])
    np.testing.assert_array_equal(with_them.rgb[seen], bare.rgb[seen])
    things = ~seen & (with_them.depth < FAR)
    assert all(len(np.unique(d[t])) <= 2 for d, t in zip(with_them.depth, things, strict=True))
    assert things.any((1, 2)).all()  # both stand in the picture from the start


def test_depth_and_limbs_are_the_same_without_colours(bodies):
    full = compose(scenery(n=12), bodies(12), time=20.0, pan=13.5)
    bare = compose(scenery(n=12), bodies(12, rgb=False), time=20.0, pan=13.5)
    assert bare.rgb is None
    np.testing.assert_array_equal(full.depth, bare.depth)
    np.testing.assert_array_equal(full.limbs, bare.limbs)


def test_distractors_walk_through_behind_and_in_front(bodies):
    made = scenery(Augmentation(distractors=2), n=60)
    depth = np.stack([compose(made, bodies(60, blank=True), time=t).depth for t in range(0, 150, 5)])
    there = depth < FAR
    assert 0.03 < there.mean() < 0.5
    assert (np.ptp(there.any(2).sum(-1), axis=0) > 0).mean() > 0.95  # who is there moves
    assert (depth[there] > 4.5).any()
    assert (depth[there] < 4.5).any()
    assert depth[there].min() > 0.5 * 4.5


def test_distractors_come_after_the_time_alone_and_before_twice_as_much(bodies):
    made = scenery(Augmentation(distractors=1, alone=1.5), n=100, fps=20.0)
    depths = (compose(made, bodies(100, blank=True), time=t).depth for t in range(400))
    there = np.array([(depth < FAR).any(axis=(1, 2)) for depth in depths])
    first = there.argmax(axis=0)
    assert there.any(axis=0).all()
    assert first.min() >= 30
    assert first.max() <= 60 + 4  # the slowest and farthest need some frames to fill half a pixel
    assert np.ptp(first) > 20
    entered = compose(made, bodies(100, blank=True), time=first.astype(float)).depth < FAR
    columns = entered.any(axis=1)
    assert (columns[:, 0] | columns[:, -1]).all()  # from a side
    assert 30 < columns[:, 0].sum() < 70
    assert 0.3 < there[200:].mean() < 0.95  # and they come again


def test_a_panning_camera_sees_the_photograph_move_left(bodies):
    made = scenery(Augmentation("clutter"), n=4)
    start, later = (compose(made, bodies(4, blank=True), pan=p).rgb.astype(int) for p in (0.0, 7.0))
    np.testing.assert_array_equal(start[:, :, 7:], later[:, :, :-7])
    half = compose(made, bodies(4, blank=True), pan=3.5).rgb.astype(int)
    three, four = (compose(made, bodies(4, blank=True), pan=p).rgb.astype(int) for p in (3.0, 4.0))
    assert np.abs(half - (three + four) / 2).max() <= 1
    round_trip = compose(made, bodies(4, blank=True), pan=2.0 * SIZE).rgb
    np.testing.assert_array_equal(start, round_trip)


def test_what_is_nearer_moves_farther_when_the_camera_pans(bodies):
    made = scenery(Augmentation(occluders=1), n=60)
    focal, behind, way = 50.0, 2 * 4.5, 0.15  # the camera goes 15 cm to its right
    start, later = (compose(made, bodies(60, blank=True), pan=p).depth for p in (0.0, way * focal / behind))
    whole = 0
    for before, after in zip(start, later, strict=True):
        columns = [np.flatnonzero((depth < FAR).any(axis=0)) for depth in (before, after)]
        if not all(len(seen) and seen[0] > 0 and seen[-1] < SIZE - 1 for seen in columns):
            continue  # cut off by the picture's edge
        whole += 1
        assert columns[0][0] - columns[1][0] == pytest.approx(way * focal / before.min(), abs=1.0)
    assert whole > 10


def test_brightness_changes_smoothly_within_its_share(bodies):
    """The mean grey level of an even backdrop against that of the same one in steady light."""
    steady = compose(scenery(Augmentation(), n=8), bodies(8, blank=True)).rgb.mean((1, 2, 3))
    made = scenery(Augmentation(brightness=0.2), n=8)
    light = np.array([compose(made, bodies(8, blank=True), time=t).rgb.mean((1, 2, 3)) for t in range(400)]) / steady
    assert (np.abs(light - 1) < 0.2 + 0.01).all()
    assert (np.ptp(light, axis=0) > 0.25).all()
    assert np.abs(np.diff(light, axis=0)).max() < 0.05
    assert np.abs(light.mean() - 1) < 0.05


def noise_of(made: Augmenter, bodies, times) -> np.ndarray:
    """What noise adds to mid-grey pictures [grey levels], (times, n, SIZE, SIZE, 3)."""
    pictures = []
    for t in times:
        frame = bodies(made.n, blank=True)
        made._colours[:], made._rise[:] = 128, 0.0
        pictures.append(compose(made, frame, time=float(t)).rgb.astype(float) - 128.0)
    return np.array(pictures)


@pytest.mark.parametrize("sigma", [0.7, 4.0, 20.0])
def test_noise_is_gaussian_and_independent_between_pixels_frames_and_episodes(sigma, bodies):
    """Mean, standard deviation (rounding adds 1/12), share within it; correlations within five standard errors."""
    noise = noise_of(scenery(Augmentation(noise=sigma), n=6), bodies, range(8))
    n = noise.size
    assert abs(noise.mean()) < 5 * sigma / np.sqrt(n) + 0.005
    assert noise.std() == pytest.approx(np.sqrt(sigma**2 + 1 / 12), rel=0.01)
    within = int(sigma)  # and what is rounded to it
    share = math.erf((within + 0.5) / sigma / math.sqrt(2))
    assert (np.abs(noise) <= within).mean() == pytest.approx(share, abs=0.01)
    pairs = {
        "frames": (noise[1:], noise[:-1]),
        "episodes": (noise[:, 1:], noise[:, :-1]),
        "rows": (noise[:, :, 1:], noise[:, :, :-1]),
        "columns": (noise[:, :, :, 1:], noise[:, :, :, :-1]),
        "colours": (noise[..., 1:], noise[..., :-1]),
    }
    for name, (a, b) in pairs.items():
        r = np.corrcoef(a.ravel(), b.ravel())[0, 1]
        assert abs(r) < 5 / np.sqrt(a.size), name


def test_noise_of_a_frame_is_always_the_same(bodies):
    made = scenery(Augmentation(noise=4.0))
    a, b, c = (compose(made, bodies(1), time=t).rgb for t in (3.0, 4.0, 3.0))
    np.testing.assert_array_equal(a, c)
    assert (a != b).mean() > 0.5


def test_photographs_have_the_spectrum_and_the_edges_of_photographs():
    """Amplitude falls like 1/f (natural images: power's slope -1.6 to -2.6 about -2), and many pixels lie on edges."""
    slopes, edges = [], []
    for number in range(16):
        grey = photograph(number, 256, 128).mean(-1)[:, :128]
        window = np.outer(np.hanning(128), np.hanning(128))
        power = np.abs(np.fft.fft2((grey - grey.mean()) * window)) ** 2
        f = np.hypot(*np.meshgrid(np.fft.fftfreq(128) * 128, np.fft.fftfreq(128) * 128))
        rings = np.array([power[(f >= r) & (f < 1.25 * r)].mean() for r in 1.25 ** np.arange(5, 18)])
        slopes.append(np.polyfit(np.log(1.25 ** np.arange(5, 18)), np.log(rings), 1)[0])
        edges.append((np.hypot(*np.gradient(grey)) > 8).mean())
        assert 40 < grey.mean() < 190
        assert grey.std() > 18
    assert -2.8 < np.mean(slopes) < -1.6
    assert np.mean(edges) > 0.15


def test_photographs_are_the_same_scene_at_every_size_and_go_on_at_their_edge():
    small, large = (photograph(3, 2 * h, h).astype(float) for h in (64, 128))
    assert np.corrcoef(small.ravel(), large.reshape(64, 2, 128, 2, 3).mean((1, 3)).ravel())[0, 1] > 0.5
    seam = np.abs(large[:, 0] - large[:, -1]).mean()
    assert seam < 2 * np.abs(np.diff(large, axis=1)).mean()


def test_sprites_cover_some_of_their_rectangle():
    covered = (sprites(SIZE, SIZE)[..., 3] > 0).mean((1, 2))
    assert (covered > 0.08).all()
    assert covered[:64].max() < 0.6  # people


def test_pickling_keeps_the_episodes(bodies):
    made = scenery(n=3)
    copy = pickle.loads(pickle.dumps(made))
    same(compose(made, bodies(3), time=11.0, pan=4.0), compose(copy, bodies(3), time=11.0, pan=4.0))
    assert len(pickle.dumps(made)) < 20_000  # the bank stays behind


@pytest.mark.parametrize("size", [(16, 16), (16, 200), (300, 17), (97, 64)])
def test_odd_sizes_are_fine(size):
    width, height = size
    made = Augmenter(FULL, 3, width, height)
    for i in range(3):
        made.begin(i, np.random.default_rng(i), distance=3.0, focal=50.0)
    frame = Frame(
        np.zeros((3, height, width, 3), np.uint8), np.full((3, height, width), np.inf, np.float32),
        np.zeros((3, height, width), np.uint8),
    )  # fmt: skip
    for time in (0, 50, 10_000):
        made.compose(frame, np.full(3, time), np.full(3, 1e5 * time), np.arange(3))
    assert np.isfinite(frame.depth).all()
    assert (frame.rgb.reshape(3, -1).std(1) > 5).all()


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"background": "beach"}, "background must be plain, clutter or a folder of photographs .*, got 'beach'"),
        ({"distractors": -1}, "distractors must be a whole number from 0"),
        ({"occluders": 1.5}, "occluders must be a whole number from 0"),
        ({"occluders": True}, "occluders"),
        ({"noise": -1}, "noise must be .* got -1"),
        ({"noise": float("nan")}, "noise"),
        ({"noise": "much"}, "noise"),
        ({"brightness": 1.0}, "brightness must be a number at least 0 and below 1"),
        ({"alone": -1.0}, "alone must be .* seconds.* got -1"),
    ],
)
def test_refuses_impossible_choices(bad, message):
    with pytest.raises(MotionError, match=message):
        Augmentation(**bad)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"choice": "clutter"}, "choice must be an Augmentation"),
        ({"n": 0}, "n must be a whole number from 1"),
        ({"width": 8}, "width must be a whole number of pixels from 16 to 1024, got 8"),
        ({"height": 1025}, "height must be"),
        ({"fps": 0.0}, "fps"),
        ({"threads": 0}, "threads"),
    ],
)
def test_refuses_impossible_settings(bad, message):
    with pytest.raises(MotionError, match=message):
        Augmenter(**{"choice": Augmentation(), "n": 1, "width": 64, "height": 64, **bad})


def test_refuses_frames_and_slots_that_do_not_fit(bodies):
    made = scenery(Augmentation())
    with pytest.raises(MotionError, match="frame must hold images of 64 × 64"):
        compose(Augmenter(Augmentation(), 1, 64, 64), bodies(1))
    with pytest.raises(MotionError, match="slots must be from 0 to 0"):
        compose(made, bodies(1), slots=[1])
    with pytest.raises(MotionError, match="time and pan finite"):
        compose(made, bodies(1), time=np.nan)
    with pytest.raises(MotionError, match="slot must be from 0 to 0, got 1"):
        made.begin(1, np.random.default_rng(0))
    with pytest.raises(MotionError, match="distance must be a number above 0"):
        made.begin(0, np.random.default_rng(0), distance=0.0)
    with pytest.raises(MotionError, match="one entry per image"):
        compose(made, bodies(2), slots=[0])
