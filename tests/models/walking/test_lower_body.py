"""Walks of captures that don't show the whole body: the model knows what they show, and says what it lacks."""

import warnings

import numpy as np
import pytest

import motionenv
from motionenv import Motion, WalkingModel
from motionenv.errors import GapError
from motionenv.models.storage.export import parameters
from motionenv.models.walking.preprocessing import find_cycles, gait_channels
from motionenv.models.walking.tables import CHANNELS, in_order, lacking_angles
from motionenv.render.video.film import film
from motionenv.tracking.priors.fpca import FPCAPrior

UPPER, LEFT_LEG, RIGHT_LEG = slice(6, 17), slice(17, 21), slice(21, 25)


@pytest.fixture(scope="module", autouse=True)
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture(scope="module")
def walks() -> list[Motion]:
    shipped = motionenv.load("walk/fpca")
    return [shipped.synthesize(6.0, 50.0, seed=seed, speed=0.9 + 0.12 * seed) for seed in range(7)]


def without(motion: Motion, part: slice) -> Motion:
    poses = motion.poses.copy()
    poses[:, part] = np.nan
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


@pytest.fixture(scope="module")
def lower(walks) -> WalkingModel:
    return WalkingModel(4).fit([without(walk, UPPER) for walk in walks])


@pytest.mark.parametrize("part", [UPPER, LEFT_LEG, RIGHT_LEG, slice(9, 13)])
def test_cycles_are_found_in_what_is_shown(walks, part):
    for walk in walks[:3]:
        whole, some = find_cycles(walk), find_cycles(without(walk, part))
        assert some.seconds == pytest.approx(whole.seconds, rel=0.01)
        n = min(len(some.starts), len(whole.starts))
        off = some.starts[:n] - whole.starts[:n]
        np.testing.assert_allclose(off - some.seconds * np.round(off / some.seconds), 0, atol=0.05)


def test_channels_that_are_shown_are_those_of_the_whole_body(walks):
    whole, some = gait_channels(walks[0]), gait_channels(without(walks[0], UPPER))
    np.testing.assert_array_equal(some[:, 11:], whole[:, 11:])
    assert np.isnan(some[:, :11]).all()
    one = gait_channels(without(walks[0], RIGHT_LEG))
    np.testing.assert_allclose(one[:, 22], whole[:, 22], atol=0.005)


def test_a_model_of_lower_bodies_walks_on_the_same_legs(walks, lower):
    """Means of the legs are those of a model of whole bodies; arms and neck stay unknown, through a file too."""
    whole = WalkingModel(4).fit(walks)
    assert lower.fpca_.channels_ == CHANNELS[11:]
    assert lower.dimensions()["channels"] == 13
    np.testing.assert_allclose(lower.fpca_.mean_, whole.fpca_.mean_[:, 11:], atol=np.radians(1.5))
    assert lacking_angles(lower) == list(range(6, 17))
    walk = lower.synthesize(2.0, 60.0, seed=3, speed=1.2)
    assert np.isnan(walk.poses[:, UPPER]).all()
    assert np.isfinite(np.delete(walk.poses, range(6, 17), axis=1)).all()
    assert (walk.poses[-1, 0] - walk.poses[0, 0]) * 60 / 119 == pytest.approx(1.2, rel=0.03)
    assert next(film(walk, width=64, height=48)).std() > 0


def test_it_is_stored_described_and_exported(lower, tmp_path):
    lower.save(tmp_path / "lower.npz")
    again = motionenv.load(tmp_path / "lower.npz")
    one, other = (model.synthesize(1.0, 30.0, seed=1).poses for model in (lower, again))
    np.testing.assert_array_equal(one, other)
    arrays, description = parameters(again)
    assert np.isnan(arrays["mean"][:, :11]).all()
    assert np.isfinite(arrays["mean"][:, 11:]).all()
    assert np.isfinite(arrays["components"]).all()
    assert {trait["name"] for trait in description["traits"]} == {"bounce", "step width"}
    assert again.describe()["dimensions"]["channels"] == 13
    assert np.isfinite(lower.score([walk for walk in [lower.synthesize(5.0, 50.0, seed=2)]]))


def test_people_of_whom_more_is_seen_tell_of_the_arms(walks):
    mixed = WalkingModel(4).fit([*(without(walk, UPPER) for walk in walks[:3]), *walks[3:]])
    whole = WalkingModel(4).fit(walks)
    assert mixed.fpca_.channels_ == CHANNELS
    assert np.isfinite(mixed.synthesize(1.0, 30.0, seed=1).poses).all()
    swing = CHANNELS.index("left_shoulder_flexion")
    assert np.corrcoef(mixed.fpca_.mean_[:, swing], whole.fpca_.mean_[:, swing])[0, 1] > 0.98


def test_what_needs_more_of_the_body_says_what(walks, lower):
    with pytest.raises(GapError, match=r"no walk shows right_hip_flexion.*motionenv\.fill"):
        WalkingModel(4).fit([without(walk, RIGHT_LEG) for walk in walks])
    with pytest.raises(GapError, match=r"doesn't know neck_flexion.*--fill"):
        FPCAPrior(lower)


def test_values_are_put_in_order():
    out = in_order(np.array([[1.0, 2.0]]), ("root_tilt", "neck_bend"), -1.0)
    assert out.shape == (1, 24)
    assert out[0, CHANNELS.index("root_tilt")] == 1
    assert out[0, CHANNELS.index("neck_bend")] == 2
    assert (out == -1).sum() == 22
