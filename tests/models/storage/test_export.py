"""What clients get of a model: enough to compute its walk on the spot from the arrays alone, and JSON."""

import json

import numpy as np
import pytest

import motionenv
from motionenv.body import LIMBS, from_height, limb_segments
from motionenv.errors import MotionError
from motionenv.models.fpca import FunctionalPCA
from motionenv.models.storage.export import parameters
from motionenv.types import MARKERS, POSE

STEPS = np.array([1.0, -0.5, 0.0, 1.5])  # deviations along the first components


def test_poses_follow_from_the_arrays_alone():
    """A client's sum over constant, cosines and sines, and its stride time, against the model."""
    model = motionenv.load("walk/fpca")
    arrays, description = parameters(model)
    assert description["treadmill"] == "poses"
    k = np.zeros(description["components"])
    k[:4] = STEPS
    scores = arrays["mean_scores"] + k * arrays["deviations"]
    series = arrays["mean"] + np.tensordot(scores, arrays["components"], axes=1)
    n, phase = (len(series) + 1) // 2, np.linspace(0, 1, 9)[:, None]
    waves = [f(2 * np.pi * phase * np.arange(1, n)) for f in (np.cos, np.sin)]
    told = np.concatenate([np.ones((9, 1)), *waves], axis=1) @ series
    np.testing.assert_allclose(told, model.fpca_.evaluate(scores, phase[:, 0]), atol=1e-9)
    log_seconds = arrays["log_seconds_mean"] + arrays["log_seconds_weights"] @ k
    assert np.exp(log_seconds) == pytest.approx(float(model.stride_seconds(scores[None])[0]))


def test_markers_follow_from_the_arrays_alone():
    model = motionenv.load("walk/eigenwalkers")
    arrays, description = parameters("walk/eigenwalkers")
    assert description["treadmill"] == "markers"
    k = np.zeros(description["components"])
    k[:4] = STEPS
    w = arrays["mean"] + np.tensordot(arrays["mean_scores"] + k * arrays["deviations"], arrays["components"], axes=1)
    np.testing.assert_allclose(w, model.inverse_transform(model.walker(deviations=k).scores), atol=1e-12)
    name = next(n for n in arrays if n.startswith("log_") and n.endswith("_mean"))
    log_frequency = arrays[name] + arrays[name.replace("mean", "weights")] @ k
    assert np.exp(log_frequency) == pytest.approx(float(model.frequency(model.walker(deviations=k).scores)))


@pytest.mark.parametrize("name", ["walk/fpca", "walk/eigenwalkers"])
def test_the_body_can_be_drawn_from_the_description(name):
    """Standing: the ends of all limbs from offsets, shifts and indices, in body heights, against kinematics."""
    arrays, told = parameters(name)
    told = json.loads(json.dumps(told))
    assert tuple(told["pose"]) == POSE
    assert tuple(told["markers"]) == MARKERS
    assert set(told["clothes"]) == set(told["colours"])
    assert arrays["limb_radii"].shape == (len(LIMBS), 2)
    assert arrays["offsets"].shape == (16, 3)
    assert len(told["traits"]) == len(arrays["traits"])
    assert all(trait["low"] != trait["high"] and trait["name"] for trait in told["traits"])
    body = from_height(1.0)
    still = limb_segments(np.zeros(25), body)
    lengths = np.linalg.norm(still[:, 1] - still[:, 0], axis=-1)
    np.testing.assert_allclose(arrays["limb_radii"], body.radii)
    one_node = [i for i, (a, b) in enumerate(told["limb_nodes"]) if a == b]
    shifts = arrays["limb_shifts"]
    np.testing.assert_allclose(np.linalg.norm(shifts[:, 1] - shifts[:, 0], axis=-1)[one_node], lengths[one_node])


def test_what_makes_no_motion_is_refused():
    with pytest.raises(MotionError, match="FunctionalPCA|fpca"):
        parameters(FunctionalPCA())
