"""The likelihood of pictures: against pictures that are drawn, against what hypotheses should score; misuse."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv.body import from_height, limb_segments
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.likelihoods._silhouette_kernel import silhouette_sums
from motionenv.likelihoods.silhouette import background_shares
from motionenv.render import Raycaster
from motionenv.render.cameras import look_at, view
from motionenv.types import Camera

BODY = from_height()


def walking(n, seed=0, spread=0.3):
    rng = np.random.default_rng(seed)
    poses = spread * rng.normal(size=(n, 25))
    poses[:, 2] += 0.9
    poses[:, 5] = rng.uniform(-np.pi, np.pi, n)
    poses[:, [12, 16, 20, 24]] = np.abs(poses[:, [12, 16, 20, 24]])
    return poses


def drawn(poses, camera, body=BODY):
    return Raycaster().render(poses, body, camera, rgb=False)


def sums(model, poses, image):
    """Sums of `image` under silhouettes, as the model computes them."""
    out = np.empty(len(poses))
    silhouette_sums(limb_segments(poses, model.skeleton), model.skeleton.radii, *model.view, image, out)
    return out


CAMERAS = {
    "64": view(0.3, width=64, height=64, distance=4.0),
    "wide": view(-1.0, width=150, height=40, distance=4.0, fov_degrees=25),
    "tall": view(2.0, width=37, height=130, distance=3.5),
    "above": look_at((0.5, -1.5, 3.0), (0, 0, 0.8), width=100, height=100, fov_degrees=60),
    "close": look_at((0.9, 0.3, 1.2), (0, 0, 1.0), width=65, height=64, fov_degrees=70),
    "skewed": Camera(
        np.array([[90, 4.0, 33], [7.0, 80, 30], [0, 0, 1]]), view(0.5).R, view(0.5).t, 64, 64
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CAMERAS)
def test_sums_are_those_of_the_drawn_pixels(name):
    """All but pixels whose centre lies on an outline to the rounding of the raycaster's float32."""
    camera, rng = CAMERAS[name], np.random.default_rng(5)
    poses = walking(400)
    pixels = drawn(poses, camera).limbs > 0
    image = rng.normal(size=pixels.shape[1:])
    off = np.abs(sums(SilhouetteLikelihood(camera), poses, image) - (pixels * image).sum((1, 2)))
    assert pixels.mean() > 0.01
    assert np.mean(off > 1e-9) < 0.01
    assert off.max() < 4 * np.abs(image).max()


def test_a_body_wherever_it_is():
    """Beside the picture, behind the camera, around the camera: what the raycaster draws, pixel by pixel."""
    camera = CAMERAS["64"]
    rng = np.random.default_rng(2)
    poses = walking(300, seed=3)
    poses[:, :2] = rng.uniform(-6, 6, (300, 2))
    poses[:20, :3] = camera.centre + 0.3 * rng.normal(size=(20, 3))
    pixels = drawn(poses, camera).limbs > 0
    ones = np.ones((64, 64))
    assert np.array_equal(sums(SilhouetteLikelihood(camera), poses, ones), pixels.sum((1, 2)))
    assert 0.2 < pixels.any((1, 2)).mean() < 0.9


def literal(model, hypothesis, p):
    """The silhouette's log-likelihood, pixel by pixel."""
    total = 0.0
    for body, seen in zip(hypothesis.ravel(), p.ravel(), strict=True):
        rate = 1 - model.misses if body else model.false_alarms
        total += np.log(seen * rate + (1 - seen) * (1 - rate))
    return total


@pytest.mark.parametrize("soft", [False, True])
def test_silhouette_is_the_product_over_pixels(soft):
    camera = CAMERAS["64"]
    truth, others = walking(1, seed=8), walking(5, seed=9)
    p = (drawn(truth, camera).limbs[0] > 0).astype(float)
    if soft:
        p = np.clip(p + 0.3 * np.random.default_rng(0).normal(size=p.shape), 0, 1)
    model = SilhouetteLikelihood(camera, misses=0.2, false_alarms=0.03, effective=None)
    model.observe(mask=p)
    want = [literal(model, limbs > 0, p) for limbs in drawn(others, camera).limbs]
    assert np.allclose(model.log_likelihood(others), want, rtol=1e-9)


def behind(mask, first, last, top):
    """A mask of which a post or box from column `first` to `last` and from row `top` down hides what is behind it."""
    seen = mask.copy()
    seen[top:, first:last] = False
    return seen


def test_what_stands_on_the_ground_can_hide_only_what_is_not_above_something_seen():
    """Pixel by pixel and column by column, from all pictures so far; another camera, or `forget`, begins anew."""
    camera, others = CAMERAS["64"], walking(4, seed=9)
    masks = [behind(m, 20, 34, 30) for m in drawn(walking(3, seed=8), camera).limbs > 0]
    model = SilhouetteLikelihood(camera, misses=0.2, false_alarms=0.03, hidden=0.8, effective=None, threads=1)

    def want(pictures):
        scores = []
        for limbs in drawn(others, camera).limbs > 0:
            total = 0.0
            for v, u in np.ndindex(64, 64):
                seen = any((m[w, u] and m[w + 1, u]) and v <= w + 1 for m in pictures for w in range(63))
                rate = (0.8 if seen else 0.2) if limbs[v, u] else 0.03
                total += np.log(rate if pictures[-1][v, u] else 1 - rate)
            scores.append(total)
        return scores

    for k, mask in enumerate(masks):
        model.observe(mask=mask)
        np.testing.assert_allclose(model.log_likelihood(others), want(masks[: k + 1]), rtol=1e-9)
    model.forget()
    model.observe(mask=masks[1])
    np.testing.assert_allclose(model.log_likelihood(others), want(masks[1:2]), rtol=1e-9)
    model.observe(mask=masks[0], camera=view(0.3, width=64, height=64, distance=4.5))
    model.observe(mask=masks[2], camera=camera)
    np.testing.assert_allclose(model.log_likelihood(others), want(masks[2:]), rtol=1e-9)


def literal_depth(model, hypothesis, observed):
    total = 0.0
    for body, seen in zip(hypothesis.ravel().astype(float), observed.ravel().astype(float), strict=True):
        rate = 1 - model.misses if body < np.inf else model.false_alarms
        if seen == np.inf:
            total += np.log(1 - rate)
            continue
        density = 1 / 4
        if body < np.inf:
            gauss = np.exp(-0.5 * ((seen - body) / model.depth_noise) ** 2) / (model.depth_noise * np.sqrt(2 * np.pi))
            density = (1 - model.outliers) * gauss + model.outliers / 4
        total += np.log(rate * density)
    return total


def test_depth_is_the_product_over_pixels():
    camera = CAMERAS["64"]
    truth, others = walking(1, seed=8), walking(5, seed=8, spread=0.32)
    observed = drawn(truth, camera).depth[0]
    model = SilhouetteLikelihood(camera, depth_noise=0.1, effective=None)
    model.observe(depth=observed)
    want = [literal_depth(model, depth, observed) for depth in drawn(others, camera).depth]
    assert np.allclose(model.log_likelihood(others), want, rtol=1e-6)
    again = model.log_likelihood(others)
    model.observe(depth=np.where(observed == np.inf, 0, observed))  # 0 is how some sensors say "nothing"
    assert np.array_equal(model.log_likelihood(others), again)


def coloured(poses, camera, seed=0, noise=3.0, gain=1.0):
    """A picture of a body of one colour before clutter, and the clutter."""
    rng = np.random.default_rng(seed)
    background = np.kron(rng.uniform(40, 200, (16, 16, 3)), np.ones((4, 4, 1)))
    body = drawn(poses, camera).limbs[0] > 0
    picture = gain * np.where(body[..., None], [200, 40, 90], background)
    return (picture + noise * rng.normal(size=picture.shape)).clip(0, 255).astype(np.uint8), background, body


SENSES = {
    "mask": lambda truth, camera: {"mask": drawn(truth, camera).limbs[0]},
    "depth": lambda truth, camera: {"depth": drawn(truth, camera).depth[0]},
    "rgb": lambda truth, camera: dict(zip(("rgb", "background"), coloured(truth, camera)[:2], strict=True)),
}


@pytest.mark.parametrize("sense", SENSES)
def test_the_further_from_the_truth_the_less_likely(sense):
    """On average over walkers, whose body isn't quite the hypotheses' own."""
    camera, scores = CAMERAS["64"], []
    sizes = np.array([0.0, 0.05, 0.1, 0.2, 0.4])
    for seed in range(12):
        truth = walking(1, seed=seed)
        model = SilhouetteLikelihood(camera, from_height(1.73))
        model.observe(**SENSES[sense](truth, camera))
        steps = np.random.default_rng(seed).normal(size=(40, 25))
        scores.append([model.log_likelihood(truth + size * steps).mean() for size in sizes])
    assert (np.diff(np.mean(scores, axis=0)) < 0).all()
    assert np.mean([row[0] == max(row) for row in scores]) > 0.8


@given(cut=st.integers(0, 700), threads=st.sampled_from([1, 2, 3]))
def test_batches_and_threads_change_nothing(cut, threads):
    camera, poses = CAMERAS["64"], walking(700, seed=4)
    model = SilhouetteLikelihood(camera, threads=threads)
    model.observe(mask=drawn(poses[0], camera).limbs)
    whole = SilhouetteLikelihood(camera, threads=1)
    whole.observe(mask=drawn(poses[0], camera).limbs)
    parts = [model.log_likelihood(poses[:cut]), model.log_likelihood(poses[cut:])]
    assert np.array_equal(np.concatenate(parts), whole.log_likelihood(poses))


@pytest.mark.parametrize("sense", SENSES)
def test_a_pickled_model_scores_the_same(sense):
    camera, poses = CAMERAS["64"], walking(600)
    model = SilhouetteLikelihood(camera, threads=2)
    model.observe(**SENSES[sense](poses[:1], camera))
    scores = model.log_likelihood(poses)
    assert np.array_equal(pickle.loads(pickle.dumps(model)).log_likelihood(poses), scores)


def test_only_so_many_of_the_bodys_pixels_count():
    """Whatever the picture's size and the distance, the same body in the same pose is about as telling."""
    poses, tempers, ratios = walking(60), [], []
    for size, distance in ((64, 4.0), (128, 4.0), (64, 8.0), (256, 8.0)):
        camera = view(0.4, width=size, height=size, distance=distance)
        pixels = (drawn(poses, camera).limbs > 0).sum((1, 2)).mean()
        model, every = SilhouetteLikelihood(camera, effective=5.0), SilhouetteLikelihood(camera, effective=None)
        for m in (model, every):
            m.observe(mask=drawn(poses[0], camera).limbs)
        tempers.append(model.temper * pixels)
        ratios.append(model.log_likelihood(poses) / every.log_likelihood(poses) / model.temper)
    assert np.allclose(ratios, 1.0)
    assert np.allclose(tempers, 5.0, rtol=0.25)
    assert every.temper == SilhouetteLikelihood(camera, effective=1e9).temper == 1.0


def test_a_given_distance_counts_as_one():
    camera = view(0.4, width=64, height=64, distance=5.0)
    origin = SilhouetteLikelihood(camera).temper
    assert SilhouetteLikelihood(camera, distance=float(np.linalg.norm(camera.centre))).temper == pytest.approx(origin)
    assert SilhouetteLikelihood(camera, distance=2.5).temper < origin


def test_the_camera_may_move():
    poses = walking(50)
    moved = view(0.9, width=64, height=64)
    model, there = SilhouetteLikelihood(CAMERAS["64"]), SilhouetteLikelihood(moved)
    for m in (model, there):
        m.observe(mask=drawn(poses[0], moved).limbs, camera=moved)
    assert np.array_equal(model.log_likelihood(poses), there.log_likelihood(poses))


def test_no_poses_give_no_scores():
    model = SilhouetteLikelihood(CAMERAS["64"])
    model.observe(mask=np.zeros((64, 64), bool))
    assert model.log_likelihood(np.empty((0, 25))).shape == (0,)


def seeing():
    model = SilhouetteLikelihood(CAMERAS["64"])
    model.observe(mask=np.ones((64, 64), bool))
    return model


@pytest.mark.parametrize(
    ("misuse", "message"),
    [
        (lambda: SilhouetteLikelihood(CAMERAS["64"]).log_likelihood(walking(1)), "nothing has been observed yet"),
        (lambda: SilhouetteLikelihood(CAMERAS["64"]).foreground, "nothing has been observed yet"),
        (lambda: seeing().log_likelihood(walking(2) * [[1.0], [np.nan]]), r"poses\[1, 0\] is nan"),
        (lambda: seeing().log_likelihood(walking(2) + np.inf), r"poses\[0, 0\] is inf"),
        (lambda: seeing().log_likelihood(walking(2)[0]), r"poses must have shape \(N, 25\), got \(25,\)"),
        (lambda: seeing().log_likelihood(np.zeros((3, 24))), r"got \(3, 24\)"),
        (lambda: seeing().observe(), "one of mask, rgb and depth, got none"),
        (lambda: seeing().observe(mask=np.ones((64, 64)), depth=np.ones((64, 64))), "got mask and depth"),
        (lambda: seeing().observe(mask=np.ones((64, 64)), background=0), "background is allowed with rgb"),
        (lambda: seeing().observe(mask=np.ones((32, 64))), r"\(64, 64\), got \(32, 64\)"),
        (lambda: seeing().observe(mask=np.full((64, 64), 1.5)), "probabilities from 0 to 1"),
        (lambda: seeing().observe(mask=np.full((64, 64), np.nan)), "probabilities from 0 to 1"),
        (lambda: seeing().observe(depth=np.full((64, 64), -1.0)), "at least 0"),
        (lambda: seeing().observe(rgb=np.zeros((64, 64, 3))), "rgb must be uint8"),
        (lambda: seeing().observe(rgb=np.zeros((64, 32, 3), np.uint8)), r"\(64, 64\), got \(64, 32\)"),
        (lambda: SilhouetteLikelihood(np.eye(3)), "camera must be a Camera"),
        (lambda: SilhouetteLikelihood(CAMERAS["64"], hidden=1.0), "hidden must be a number above 0 and below 1"),
        (lambda: SilhouetteLikelihood(CAMERAS["64"], misses=0.0), "misses must be a number above 0 and below 0.5"),
        (
            lambda: SilhouetteLikelihood(CAMERAS["64"], false_alarms=0.7),
            "false_alarms must be a number above 0 and below 0.5",
        ),
        (lambda: SilhouetteLikelihood(CAMERAS["64"], depth_noise=0), "depth_noise must be a number above 0"),
        (lambda: SilhouetteLikelihood(CAMERAS["64"], distance=np.inf), "distance must be a number above 0"),
        (lambda: SilhouetteLikelihood(CAMERAS["64"], effective=-1), "effective must be a number above 0"),
        (lambda: SilhouetteLikelihood(CAMERAS["64"], threads=0), "threads must be a whole number"),
    ],
)
def test_misuse_is_named(misuse, message):
    with pytest.raises(MotionError, match=message):
        misuse()


def test_a_refused_observation_leaves_the_last_one():
    model, poses = seeing(), walking(3)
    scores = model.log_likelihood(poses)
    with pytest.raises(MotionError):
        model.observe(mask=np.ones((3, 3)))
    assert np.array_equal(model.log_likelihood(poses), scores)


@pytest.mark.parametrize("form", ["mask", "depth"])
def test_pixels_where_nothing_can_be_seen_say_nothing(form):
    """However bodies differ behind them; pixels add up, so that each half of a picture says what is in it."""
    camera, body = view(0.2, width=64, height=64, distance=4.0), from_height()
    poses = np.zeros((6, 25))
    poses[:, 2], poses[:, 17] = 0.93, np.linspace(-0.8, 0.8, 6)
    frames = Raycaster().render(poses, body, camera, rgb=False)
    shown = frames.limbs[0] > 0 if form == "mask" else frames.depth[0]
    model = SilhouetteLikelihood(camera, body, effective=None)
    below = np.zeros((64, 64), dtype=bool)
    below[25:] = True
    nothing, said = 0.5 if form == "mask" else np.nan, []
    for hidden in (below, ~below, below & ~below, below | ~below):
        model.observe(**{form: np.where(hidden, nothing, shown)})
        said.append(model.log_likelihood(poses))
    above, under, everything, unknown = said
    np.testing.assert_allclose(above + under, everything + unknown, atol=1e-4)
    np.testing.assert_allclose(np.ptp(unknown), 0.0, atol=1e-9)


TALLER = from_height(1.7)
CAMERA = view(0.3, width=40, height=60, distance=4.0)


@pytest.fixture(scope="module")
def poses():
    poses = 0.3 * np.random.default_rng(0).normal(size=(3, 25))
    poses[:, 2] += 0.9
    return poses


def bare(poses, weights=None) -> np.ndarray:
    return background_shares(Raycaster(), TALLER, poses, weights, CAMERA)


def pictures(poses) -> np.ndarray:
    """One picture (height, width) for each pose, 1 where it shows no limb."""
    return (Raycaster().render(poses, TALLER, CAMERA, rgb=False).limbs == 0).astype(float)


def test_of_one_pose_it_is_the_picture(poses):
    expected = pictures(poses[:1])[0]
    np.testing.assert_array_equal(bare(poses[0]), expected)
    np.testing.assert_array_equal(bare(poses, [-np.inf, -np.inf, 0.0][::-1]), expected)


@pytest.mark.parametrize("shift", [0.0, 700.0, -700.0])
def test_of_several_it_is_their_mean_by_weight(poses, shift):
    """Weights of whole 24ths, of which as many pictures are drawn."""
    weights = np.array([3, 9, 12]) / 24
    expected = np.tensordot(weights, pictures(poses), axes=1)
    np.testing.assert_allclose(bare(poses, np.log(weights) + shift), expected, atol=1e-12)


def test_equal_weights_are_the_default_and_nothing_is_left_to_chance(poses):
    np.testing.assert_array_equal(bare(poses), bare(poses, np.full(3, -5.0)))
    np.testing.assert_allclose(bare(poses), pictures(poses).mean(axis=0), atol=1e-12)


@pytest.mark.parametrize(
    ("n", "weights"), [(3, np.zeros(2)), (3, np.full(3, -np.inf)), (3, [0, np.nan, 0]), (0, np.zeros(0))]
)
def test_weights_that_do_not_belong_to_the_poses_are_refused(poses, n, weights):
    with pytest.raises(MotionError, match=rf"log_weights must be \({n},\), at least one above -inf, got"):
        bare(poses[:n], weights)
