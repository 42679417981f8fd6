"""What every gait model promises, ours and those of other packages that are installed: `motionenv.models.GaitModel`."""

import dataclasses
import json
import pickle

import numpy as np
import pytest

import motionenv
from motionenv import GaitModel, Motion, MotionError, Walker
from motionenv.body import markers
from motionenv.body.kinematics import feet
from motionenv.models import FixedModel, names
from motionenv.models.people import average_person


class Bounce(FixedModel):
    """The least that a model is."""

    kind, card_ = "bounce", {"data": "none"}

    def make_motion(self, walker, request, rng):
        body = self.body(request.height)
        poses = np.zeros((request.frames, 25))
        poses[:, 0] = (request.speed or 1.0) * np.arange(request.frames) / request.fps
        poses[:, 2] = 0.55 * body.height
        return Motion(poses, body, request.fps, "bounce")


@pytest.fixture(scope="module", params=[*names(), "a model of code alone"])
def model(request) -> GaitModel:
    return motionenv.load(request.param) if request.param in names() else Bounce()


def same(one: Motion, other: Motion) -> bool:
    return one.poses.tobytes() == other.poses.tobytes() and one.skeleton.height == other.skeleton.height


def test_the_same_seed_gives_the_same_bytes(model):
    first = model.synthesize(2, 30, seed=5)
    assert same(first, model.synthesize(2, 30, seed=np.random.default_rng(5)))
    assert same(first, motionenv.synthesize(model, 2, 30, seed=5))
    somebody = model.walker(seed=3)
    again = pickle.loads(pickle.dumps(model))
    assert same(model.synthesize(2, 30, walker=somebody, seed=1), again.synthesize(2, 30, walker=somebody, seed=1))


def test_walkers_are_values(model):
    one, other = model.walker(seed=1), model.walker(seed=1)
    assert one == other
    assert hash(one) == hash(other)
    assert pickle.loads(pickle.dumps(one)) == one
    assert Walker(**json.loads(json.dumps(dataclasses.asdict(one)))) == one
    if len(model.components()):
        assert model.walker(seed=2) != one


@pytest.mark.parametrize(("seconds", "fps"), [(2, 30), (1.5, 60.0), (1, 24)])
def test_motion_is_as_long_as_asked_and_finite(model, seconds, fps):
    motion = model.synthesize(seconds, fps, seed=0)
    assert isinstance(motion, Motion)
    assert motion.poses.shape == (round(seconds * fps), 25)
    assert motion.fps == fps
    assert np.isfinite(motion.poses).all()


def test_height_is_met_and_feet_are_on_the_ground(model):
    for height in (None, 1.5, 1.9):
        motion = model.synthesize(3, 60, seed=2, height=height)
        body = motion.skeleton
        assert height is None or body.height == pytest.approx(height, abs=1e-12)
        assert 1.3 < body.height < 2.2
        lowest = feet(motion.poses, body)[0][..., 2].min(axis=1) / body.height
        assert -0.02 < lowest.min()
        assert lowest.max() < 0.12


def test_a_steady_walk_goes_along_x_at_the_speed_asked_for(model):
    if not model.steady:
        pytest.skip(f"{model.kind} doesn't walk steadily")
    for seed in range(3):
        motion = model.synthesize(6, 60, seed=seed, speed=1.3, height=1.7)
        way = motion.poses[-1, :2] - motion.poses[0, :2]
        assert way[0] * 60 / 359 == pytest.approx(1.3, rel=0.03)  # a part of a cycle may be slower than the whole
        assert abs(way[1]) < 0.1 * way[0]
        np.testing.assert_allclose(motion.poses[0, :2], 0, atol=0.05)


def test_a_batch_is_of_the_heights_and_speeds_asked_for(model):
    heights, speeds = [1.6, 1.8, 1.7], [1.1, 1.4, 1.2]
    made = model.synthesize_batch(4, 30, heights=heights, speeds=speeds, seed=4)
    again = model.synthesize_batch(4, 30, heights=np.array(heights), speeds=speeds, seed=4)
    assert all(same(one, other) for one, other in zip(made, again, strict=True))
    assert [motion.skeleton.height for motion in made] == pytest.approx(heights)
    if model.steady:
        ways = [motion.poses[-1, 0] - motion.poses[0, 0] for motion in made]
        np.testing.assert_allclose(np.array(ways) * 30 / 119, speeds, rtol=0.08)


def test_a_model_without_components_takes_no_scores(model):
    if len(model.components()):
        pytest.skip(f"{model.kind} has components")
    with pytest.raises(MotionError, match="has no components"):
        model.walker(scores=[0.0])
    with pytest.raises(MotionError, match="has no components"):
        motionenv.synthesize(model, 1, 30, deviations=[1.0])


def test_given_walkers_are_along_the_components(model):
    components = model.components()
    if not len(components):
        pytest.skip(f"{model.kind} has no components")
    average = model.walker(scores=[])
    assert average == model.walker(deviations=[0.0])
    np.testing.assert_allclose(average.scores, components.means)
    tall = model.walker(deviations=[0.0, 2.0])
    assert tall.scores[1] == pytest.approx(components.means[1] + 2 * components.deviations[1])
    assert not same(*(model.synthesize(1, 30, walker=who, seed=0) for who in (average, tall)))
    for wrong in ({"scores": [0.0] * (len(components) + 1)}, {"deviations": [np.nan]}, {"scores": [[0.0]]}):
        with pytest.raises(MotionError, match="up to .* finite numbers"):
            model.walker(**wrong)
    for both in ({"scores": [0.0], "deviations": [0.0]}, {"seed": 1, "scores": [0.0]}):
        with pytest.raises(MotionError, match="give one of them"):
            model.walker(**both)


def test_components_and_traits_belong_together(model):
    components = model.components()
    assert len(components.names) == len(components.means) == len(components.deviations) == len(components.shares)
    assert (components.deviations > 0).all()
    assert (components.shares >= 0).all()
    assert components.shares.sum() <= 1 + 1e-9
    for trait in model.traits():
        assert trait.direction.shape == components.means.shape


def test_somebody_of_another_model_is_refused(model):
    with pytest.raises(MotionError, match="walker is of a strange model"):
        model.synthesize(1, 30, walker=Walker("strange"))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seconds", 0), ("seconds", np.nan), ("seconds", 1e9), ("seconds", True), ("seconds", 0.001),
        ("fps", -1), ("fps", np.nan), ("fps", 1e6), ("fps", "30"),
        ("speed", 0), ("speed", np.nan), ("speed", 9), ("speed", "1"),
        ("height", 0), ("height", np.inf), ("height", 170),
        ("phase", np.nan), ("variation", -1), ("variation", np.nan),
    ],
)  # fmt: skip
def test_what_is_out_of_range_is_named(model, name, value):
    with pytest.raises(MotionError, match=name):
        model.synthesize(**{"seconds": 1, "fps": 30, "seed": 0, name: value})


def test_a_model_without_cycles_takes_no_phase_or_variation(model):
    for given in ({"phase": 0.5}, {"variation": 0.0}):
        if model.steady:
            assert model.synthesize(1, 30, seed=0, **given).poses.shape == (30, 25)
        else:
            with pytest.raises(MotionError, match="no cycles"):
                model.synthesize(1, 30, seed=0, **given)


def test_its_description_is_json(model):
    told = json.loads(json.dumps(model.describe()))
    assert told["kind"] == model.kind
    assert len(told["components"]) == len(model.components())
    assert ("deviations" in told["takes"]) == bool(told["components"])
    assert ("variation" in told["takes"]) == model.steady
    arrays, description = motionenv.models.parameters(model)
    json.dumps(description)
    assert arrays["offsets"].shape == (16, 3)
    assert description["treadmill"] == told["treadmill"]


def test_a_treadmill_shows_who_is_asked_for(model):
    treadmill = model.treadmill()
    if treadmill is None:
        pytest.skip(f"{model.kind} has no treadmill")
    scores = np.array([model.walker(deviations=[d]).scores for d in (-1.0, 0.0, 1.0)])
    positions, heights = treadmill.crowd(scores)
    assert positions.shape[0::2] == (3, 15)
    assert heights.shape == (3,)
    walk = model.synthesize(6, 60, walker=model.walker(deviations=[1.0]), variation=0.0, seed=0)
    way = markers(walk.poses, walk.skeleton)[[0, -1], 2, 0]
    assert (way[1] - way[0]) * 60 / 359 == pytest.approx(average_person(heights[2]).speed, rel=0.04)


def test_saved_and_loaded_it_makes_the_same_motion(model, tmp_path):
    if model.kind == "bounce":
        pytest.skip("no package registers its class; test_plugin.py saves and loads a model whose package does")
    model.save(tmp_path / "model.npz", {"data": "ours"})
    again = motionenv.load(tmp_path / "model.npz")
    assert again.card_ == {"data": "ours"}
    assert again.describe() == model.describe() | {"card": {"data": "ours"}}
    assert same(again.synthesize(1, 30, seed=3), model.synthesize(1, 30, seed=3))


def test_a_steerable_model_grows_the_same_however_it_is_cut(model):
    if not model.steerable:
        pytest.skip(f"{model.kind} can't be steered")
    growth, other = (model.generator(model.activities[0], seed=2, temperature=0.1) for _ in range(2))
    np.testing.assert_array_equal(np.concatenate([growth.step(7), growth.step(13)]), other.step(20))
    assert growth.fps > 0
    assert growth.skeleton.height > 0


def test_a_fixed_model_learns_nothing_and_has_any_height():
    bounce = Bounce()
    with pytest.raises(MotionError, match="a bounce model has no parameters: there is nothing to fit"):
        bounce.fit([])
    assert bounce.body(1.6).height == pytest.approx(1.6)
    with pytest.raises(MotionError, match=r"height must be a number of metres from 0.5 to 2.5, got 3.0"):
        bounce.body(3.0)
    assert bounce.traits() == []
    assert bounce.walker(seed=1) == bounce.walker(seed=2)
