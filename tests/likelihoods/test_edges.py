"""The likelihood of edges: against outlines of drawn silhouettes, and what should score best; misuse."""

import numpy as np
import pytest
from scipy import ndimage

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.likelihoods.edges import EdgeLikelihood, outline_sums, steepness
from motionenv.render import Raycaster
from motionenv.render.cameras import look_at, view

CAMERA = view(0.3, width=96, height=96, distance=4.0)
NOTHING = np.zeros((96, 97))


def walking(n, seed=0, spread=0.25):
    poses = spread * np.random.default_rng(seed).normal(size=(n, 25))
    poses[:, :2] = 0.0
    poses[:, 2] = 0.93
    return poses


def drawn(poses, camera=CAMERA):
    return Raycaster().render(poses, from_height(), camera, rgb=True)


def along(model, image, poses):
    return outline_sums(model, np.zeros_like(image), image, poses, model.workers)[1]


def test_points_lie_on_the_outlines_of_drawn_silhouettes():
    """Brute force: the dense distance transform of each drawn outline, averaged along the sampled one."""
    model, poses = EdgeLikelihood(CAMERA), walking(60)
    masks = drawn(poses).limbs > 0
    for pose, mask in zip(poses, masks, strict=True):
        outline = mask & ~ndimage.binary_erosion(mask)
        distance = ndimage.distance_transform_edt(~outline)
        length = along(model, np.ones((96, 96)), pose[None])[0]
        assert along(model, distance, pose[None])[0] / length < 0.9
        crofton = np.pi / 4 * sum((np.diff(mask.astype(int), axis=axis) != 0).sum() for axis in (0, 1))
        assert 0.7 < length / crofton < 1.7  # where limbs overlap side by side, each has an outline


@pytest.mark.parametrize("sense", ["mask", "rgb", "depth"])
def test_the_true_pose_scores_best_among_its_neighbours(sense):
    """On pictures with noise and clutter; hypotheses err by more and more."""
    rng, poses = np.random.default_rng(3), walking(6, seed=1)
    behind = np.kron(rng.integers(60, 200, (8, 8, 3)), np.ones((12, 12, 1)))
    for pose in poses:
        seen = drawn(pose)
        if sense == "mask":
            given = {"mask": (seen.limbs > 0) ^ (rng.random((96, 96)) < 0.02)}
        elif sense == "depth":
            given = {"depth": seen.depth}
        else:
            noisy = np.where(seen.limbs[..., None] > 0, seen.rgb, behind) + rng.normal(0, 4, (96, 96, 3))
            given = {"rgb": np.clip(noisy, 0, 255).astype(np.uint8)}
        model = EdgeLikelihood(CAMERA)
        model.observe(**given)
        directions = rng.normal(size=(40, 25)) * np.r_[0.3, 0.3, 0.3, np.ones(22)]
        means = [model.log_likelihood(pose + size * directions).mean() for size in (0.0, 0.1, 0.3, 0.6)]
        assert means == sorted(means, reverse=True)
        assert means[0] > 0 > means[-1] - means[0]


def test_a_given_background_takes_its_edges_away():
    rng, pose = np.random.default_rng(5), walking(1)[0]
    behind = np.kron(rng.integers(0, 255, (24, 24, 3)), np.ones((4, 4, 1)))
    rgb = np.where(drawn(pose).limbs[..., None] > 0, 128, behind).astype(np.uint8)
    with_it, without = EdgeLikelihood(CAMERA), EdgeLikelihood(CAMERA)
    with_it.observe(rgb=rgb, background=behind)
    without.observe(rgb=rgb)
    assert with_it.log_likelihood(pose[None])[0] > without.log_likelihood(pose[None])[0] + 1


def test_any_number_of_threads_and_any_cut_give_the_same():
    poses = walking(777)
    mask = drawn(poses[0]).limbs
    scores = []
    for threads in (1, 2, 5):
        model = EdgeLikelihood(CAMERA, threads=threads)
        model.observe(mask=mask)
        scores.append(model.log_likelihood(poses))
    np.testing.assert_array_equal(scores[0], scores[1])
    np.testing.assert_array_equal(scores[0], scores[2])
    np.testing.assert_array_equal(scores[0][5:90], model.log_likelihood(poses[5:90]))
    assert model.log_likelihood(np.empty((0, 25))).shape == (0,)


def test_bodies_beside_and_behind_the_camera_have_finite_scores():
    camera = look_at((0.6, 0.2, 1.2), (0, 0, 1.0), width=96, height=96)
    model, poses = EdgeLikelihood(camera), walking(200)
    poses[:, :2] = np.random.default_rng(0).normal(size=(200, 2)) * 2
    model.observe(mask=drawn(poses[0], camera).limbs)
    assert np.isfinite(model.log_likelihood(poses)).all()
    poses[:, 0] = 100.0
    assert np.isfinite(model.log_likelihood(poses)).all()


def test_no_edges_say_nothing():
    model = EdgeLikelihood(CAMERA)
    model.observe(rgb=np.full((96, 96, 3), 77, np.uint8))
    np.testing.assert_array_equal(model.log_likelihood(walking(5)), np.zeros(5))


def test_steepness_of_a_ramp():
    np.testing.assert_allclose(steepness(np.arange(20.0) * np.ones((20, 1)) * 3)[5:-5, 5:-5], 3.0, rtol=1e-3)


def test_misuse():
    for wrong in ({"outliers": 0.0}, {"noise": -1.0}, {"effective": np.nan}, {"distance": 0.0}, {"threads": 0}):
        with pytest.raises(MotionError, match=next(iter(wrong))):
            EdgeLikelihood(CAMERA, **wrong)
    model = EdgeLikelihood(CAMERA)
    with pytest.raises(MotionError, match="observe"):
        model.log_likelihood(walking(1))
    with pytest.raises(MotionError, match="one of mask"):
        model.observe()
    with pytest.raises(MotionError, match="one of mask"):
        model.observe(rgb=np.zeros((96, 96, 3), np.uint8), mask=np.zeros((96, 96)))
    with pytest.raises(MotionError, match="size"):
        model.observe(rgb=np.zeros((9, 96, 3), np.uint8))
    with pytest.raises(MotionError, match="background"):
        model.observe(rgb=np.zeros((96, 96, 3), np.uint8), background=np.zeros((9, 9, 3)))
    model.observe(mask=np.zeros((96, 96), bool))
    with pytest.raises(MotionError, match="finite"):
        model.log_likelihood(np.full((1, 25), np.nan))


@pytest.mark.parametrize("form", ["mask", "rgb"])
def test_edges_where_nothing_can_be_seen_do_not_count(form):
    """A bright post before the body: its own outline says nothing, nor does what it hides."""
    camera = view(0.2, width=64, height=64, distance=4.0)
    poses = np.zeros((6, 25))
    poses[:, 2], poses[:, 0] = 0.93, np.linspace(-0.5, 0.5, 6)
    frame = Raycaster().render(poses[2], from_height(), camera)
    post = np.zeros((64, 64), dtype=bool)
    post[:, 30:33] = True
    whole = frame.limbs > 0 if form == "mask" else frame.rgb
    behind = whole.copy()
    behind[post] = 0 if form == "mask" else 250
    model = EdgeLikelihood(camera)
    model.observe(**{form: behind}, unseen=post)
    assert model.odds is not None
    np.testing.assert_array_equal(model.odds[post], 0.0)
    hidden = model.log_likelihood(poses)
    model.observe(**{form: behind})
    assert not np.array_equal(model.log_likelihood(poses), hidden)
    model.observe(**{form: behind}, unseen=np.ones((64, 64), dtype=bool))
    np.testing.assert_array_equal(model.log_likelihood(poses), 0.0)
    with pytest.raises(MotionError, match="unseen"):
        model.observe(**{form: behind}, unseen=np.zeros((9, 9), dtype=bool))
