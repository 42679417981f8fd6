"""One way to ask either walking model, and bodies scaled."""

import numpy as np
import pytest

import motionenv
from motionenv.body import markers
from motionenv.errors import ModelError, MotionError
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.people import average_person
from motionenv.models.synthesis import synthesize
from motionenv.models.transforms import scaled
from motionenv.models.walking.preprocessing import gait_channels, walking_cycles
from motionenv.types import Cycles

MODELS = ("walk/fpca", "walk/eigenwalkers", "walk/prior")


@pytest.mark.parametrize("model", MODELS)
def test_a_name_a_path_and_a_model_give_the_same_walk(model, tmp_path):
    fitted = motionenv.load(model)
    fitted.save(tmp_path / "m.npz")
    walks = [synthesize(m, 2, 30, seed=4).poses for m in (model, str(tmp_path / "m.npz"), tmp_path / "m.npz", fitted)]
    assert walks[0].shape == (60, 25)
    assert len({w.tobytes() for w in walks}) == 1
    assert (synthesize(model, 2, 30, seed=5).poses != walks[0]).any()


@pytest.mark.parametrize("model", MODELS)
def test_walkers_of_every_seed_move_as_people_do(model):
    for seed in range(8):
        motion = synthesize(model, 3, 60, seed=seed)
        height = motion.poses[:, 2] / motion.skeleton.height
        assert height.min() > 0.4
        assert height.max() < 0.58
        assert np.degrees(motion.poses[:, [12, 16]].min()) > -1  # knees
        assert np.degrees(motion.poses[:, [20, 24]].min()) > -10  # elbows, which many people overextend so far
        left, right = (motion.poses[:, i] - motion.poses[:, i].mean() for i in (17, 21))
        assert (left * right).sum() < -0.5 * np.sqrt((left**2).sum() * (right**2).sum())


def test_scaling_keeps_angles_and_scales_every_marker():
    motion = synthesize("walk/fpca", 1, 30, seed=0)
    half = scaled(motion, motion.skeleton.height / 2)
    np.testing.assert_array_equal(half.angles, motion.angles)
    np.testing.assert_allclose(
        markers(half.poses, half.skeleton), markers(motion.poses, motion.skeleton) / 2, atol=1e-12
    )
    for height in (0.1, 3.0, np.nan):
        with pytest.raises(MotionError, match="height"):
            scaled(motion, height)


def test_what_does_not_walk_is_refused():
    values = np.random.default_rng(0).standard_normal((9, 40, 2))
    cycles = Cycles(values, ("a", "b"), np.ones(9), np.arange(9), ("one",) * 9)
    with pytest.raises(MotionError, match="makes no motion"):
        synthesize(FunctionalPCA(2, n_harmonics=4).fit(cycles), 1, 30)
    with pytest.raises(ModelError, match="walk/fpca"):
        synthesize("walk/none", 1, 30)


@pytest.mark.parametrize("fps", [30.0, 60.0, 24.0])
def test_a_tree_at_any_frame_rate_and_height(fps):
    """The frames at 30 per second are the tree's own; others lie between them."""
    own = synthesize("mixed/tree", 3, 30, seed=4, speed=1.2)
    motion = synthesize("mixed/tree", 3, fps, seed=4, speed=1.2)
    assert motion.poses.shape == (3 * fps, 25)
    assert motion.fps == fps
    every = 10 if fps == 30 else 20 if fps == 60 else 8
    np.testing.assert_allclose(motion.poses[::every], own.poses[::10], atol=1e-6)
    tall = synthesize("mixed/tree", 3, fps, seed=4, height=1.9)
    assert tall.skeleton.height == 1.9


@pytest.mark.parametrize("height", [None, 1.5])
def test_a_tree_is_steered_to_the_speed_asked_for(height):
    """It keeps to what it knows, so only roughly: slow walks stay slower than fast ones."""

    def speed(asked: float) -> float:
        walks = [synthesize("mixed/tree", 10, 30, seed=i, speed=asked, height=height).poses for i in range(4)]
        return float(np.mean([np.linalg.norm(np.diff(p[60::15, :2], axis=0), axis=1).mean() * 2 for p in walks]))

    slow, fast = speed(0.8), speed(1.7)
    assert slow < fast - 0.05
    assert slow < 1.3
    assert fast > 1.1


@pytest.mark.parametrize("model", MODELS)
def test_deviations_are_along_the_components(model):
    fitted = motionenv.load(model)
    mean, deviation = fitted.components().means, fitted.components().deviations
    scores = mean + deviation * np.eye(len(mean))[1] * 1.5
    walks = [synthesize(fitted, 2, 30, seed=3, **who) for who in (
        {"deviations": [0, 1.5]}, {"deviations": [0.0, 1.5, 0.0]}, {"scores": scores}, {"scores": scores[:2]},
    )]  # fmt: skip
    assert len({walk.poses.tobytes() for walk in walks}) == 1
    assert (synthesize(fitted, 2, 30, seed=3, deviations=[0, -1.5]).poses != walks[0].poses).any()


def test_a_given_style_walks_at_the_pace_of_people():
    for name in ("walk/fpca", "walk/eigenwalkers", "walk/prior"):
        for deviations in ([], [2.0], [-2.0, 1.0]):
            walk = synthesize(name, 8, 60, deviations=deviations, variation=0.0)
            speed = (walk.poses[-1, 0] - walk.poses[0, 0]) * 60 / 479
            assert speed == pytest.approx(average_person(walk.skeleton.height).speed, rel=0.04)


def test_a_walker_of_scores_alone_has_them_and_their_pace():
    model = motionenv.load("walk/fpca")
    mean, deviation = model.components().means, model.components().deviations
    walker = motionenv.Walker(model.kind, model.walker(deviations=[1.0, -0.5]).scores)
    motion = model.synthesize(8, 60, walker=walker, variation=0.0)
    cycles = walking_cycles([gait_channels(motion)], [60], ["her"])
    got = np.median(model.fpca_.transform(cycles.values), axis=0)
    np.testing.assert_allclose((got - mean)[:2] / deviation[:2], [1.0, -0.5], atol=0.25)
    # Closed form of a Gaussian's conditional mean by regression on many draws.
    drawn = model.sample(20_000, seed=0)
    design = np.c_[np.ones(20_000), drawn.scores]
    weights = np.linalg.lstsq(design, np.log(drawn.seconds), rcond=None)[0]
    expected = np.exp(weights @ [1, *(mean + deviation * [1.0, -0.5, 0, 0, 0, 0, 0, 0])])
    assert cycles.seconds[0] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("model", MODELS)
def test_a_given_walker_goes_at_the_speed_that_is_asked_for(model):
    motion = synthesize(model, 6, 60, seed=1, deviations=[1.0], speed=1.2, height=1.6)
    assert (motion.poses[-1, 0] - motion.poses[0, 0]) * 60 / 359 == pytest.approx(1.2, rel=0.03)
    assert motion.skeleton.height == pytest.approx(1.6)
