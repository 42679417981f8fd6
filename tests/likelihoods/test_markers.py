"""The likelihood of 2D markers, against a computation marker by marker."""

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.errors import MotionError
from motionenv.likelihoods import MarkerLikelihood
from motionenv.render.cameras import Orthographic, orthographic, project, view

BODY = from_height()
VIEWS = {"camera": view(0.4, width=100, height=80), "orthographic": Orthographic(0.4, 30.0), "angle": 0.4}


def poses(n, seed=0, spread=0.2):
    drawn = spread * np.random.default_rng(seed).normal(size=(n, 25))
    drawn[:, 2] += 0.9
    return drawn


def shown(pose, where, body=BODY):
    points = markers(pose, body)
    return orthographic(points, where) if isinstance(where, float) else project(points, where)[0]


@pytest.mark.parametrize("where", VIEWS.values(), ids=VIEWS)
def test_it_is_the_product_over_the_markers_seen(where):
    truth, others = poses(1, seed=1)[0], poses(6, seed=2)
    points, seen = shown(truth, where), np.arange(15) % 4 > 0
    model = MarkerLikelihood(where, noise=0.1 if isinstance(where, float) else 4.0, outliers=0.1)
    model.observe(points, seen)
    area = 4.0 if isinstance(where, float) else where.width * where.height
    want = []
    for pose in others:
        distance = np.linalg.norm(shown(pose, where) - points, axis=-1)[seen]
        gauss = np.exp(-((distance / model.noise) ** 2) / 2) / (2 * np.pi * model.noise**2)
        want.append(np.log(0.9 * gauss + 0.1 / area).sum())
    assert np.allclose(model.log_likelihood(others), want)
    gaps = points.copy()
    gaps[~seen] = np.nan
    model.observe(gaps)
    assert np.allclose(model.log_likelihood(others), want)


@pytest.mark.parametrize("where", VIEWS.values(), ids=VIEWS)
def test_the_further_from_the_truth_the_less_likely(where):
    sizes, scores = np.array([0.0, 0.03, 0.1, 0.3]), []
    for seed in range(10):
        truth = poses(1, seed=seed)
        model = MarkerLikelihood(where)
        model.observe(shown(truth[0], where, from_height(1.7)))
        steps = np.random.default_rng(seed).normal(size=(50, 25))
        scores.append([model.log_likelihood(truth + size * steps).mean() for size in sizes])
    assert (np.diff(np.mean(scores, axis=0)) < 0).all()


def test_one_wrong_marker_costs_no_more_than_an_outlier():
    truth = poses(1)
    model = MarkerLikelihood(0.0)
    points = shown(truth[0], 0.0)
    model.observe(points)
    best = model.log_likelihood(truth)
    points[3] += 100
    model.observe(points)
    worse = model.log_likelihood(truth)
    assert best - worse < np.log((1 - model.outliers) / (2 * np.pi * model.noise**2) / (model.outliers / 4)) + 0.1


def test_nothing_seen_says_nothing():
    model = MarkerLikelihood(0.0)
    model.observe(np.zeros((15, 2)), np.zeros(15, bool))
    assert np.array_equal(model.log_likelihood(poses(3)), np.zeros(3))


def test_a_body_behind_the_camera_is_unlikely_not_unknown():
    where, behind = VIEWS["camera"], poses(2)
    behind[1, :3] = where.centre + where.R.T @ [0, 0, -3]
    model = MarkerLikelihood(where)
    model.observe(shown(behind[0], where))
    near, far = model.log_likelihood(behind)
    assert np.isfinite(far)
    assert far < near - 20


def seeing(where=0.0):
    model = MarkerLikelihood(where)
    model.observe(np.zeros((15, 2)))
    return model


@pytest.mark.parametrize(
    ("misuse", "message"),
    [
        (lambda: MarkerLikelihood(0.0).log_likelihood(poses(1)), "no points have been observed yet"),
        (lambda: seeing().log_likelihood(poses(1) * np.nan), r"poses\[0, 0\] is nan"),
        (lambda: seeing().log_likelihood(poses(1)[0]), r"\(N, 25\)"),
        (lambda: seeing().observe(np.zeros((14, 2))), r"\(15, 2\)"),
        (lambda: seeing().observe(np.full((15, 2), np.inf)), "must be finite"),
        (lambda: MarkerLikelihood("side"), "view must be"),
        (lambda: MarkerLikelihood(0.0, noise=0), "noise must be"),
        (lambda: MarkerLikelihood(0.0, outliers=0), "outliers must be"),
    ],
)
def test_misuse_is_named(misuse, message):
    with pytest.raises(MotionError, match=message):
        misuse()
