"""Eigenwalkers against numpy's eigendecomposition, Monte Carlo, hidden data, and the ground that they walk on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from motionenv.body.kinematics import FOOT_BALL, forward, markers
from motionenv.body.skeleton import NODES, SEGMENTS, from_height
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import FourierWalker, centred, grounded, in_phase, positions_at
from motionenv.models.eigenwalkers.locomotion import gait
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.regression import shrunk_regression
from motionenv.models.registry import load
from motionenv.models.storage.model_file import save_model
from motionenv.types import MARKERS, POSE, Markers

ANKLES = [NODES.index("left_ankle"), NODES.index("right_ankle")]
FEET = [SEGMENTS.index("left_foot"), SEGMENTS.index("right_foot")]


def stride(height=1.75, swing=0.4, lean=0.05, phase=None) -> np.ndarray:
    """Poses (frames, 25) of a plausible walk, made by hand from sines."""
    phase = np.linspace(0, 6 * np.pi, 300) if phase is None else phase
    poses = np.zeros((len(phase), 25))
    poses[:, 2], poses[:, POSE.index("root_tilt")] = 0.52 * height, lean
    for side, lead in (("left", 0.0), ("right", np.pi)):
        poses[:, POSE.index(f"{side}_hip_flexion")] = 0.15 + swing * np.cos(phase - lead)
        poses[:, POSE.index(f"{side}_knee_flexion")] = 0.5 + 0.4 * np.cos(phase - lead + 1.3)
        poses[:, POSE.index(f"{side}_shoulder_flexion")] = -0.8 * swing * np.cos(phase - lead)
        poses[:, POSE.index(f"{side}_elbow_flexion")] = 0.4 - 0.2 * np.cos(phase - lead)
    return poses


def walker(seed) -> FourierWalker:
    """A walk of a person with its own height, stride and lean, seen on a treadmill."""
    rng = np.random.default_rng(seed)
    height, swing = rng.normal(1.75, 0.08), rng.normal(0.4, 0.05)
    positions = markers(stride(height, swing, rng.normal(0.05, 0.03)), from_height(height))
    positions = positions + 0.002 * rng.standard_normal(positions.shape)
    made = fourier_walker(Markers(MARKERS, positions, 100.0), frequencies=(0.8, 1.2))
    return FourierWalker(made.coefficients, 0.9 * (swing / 0.4) * np.exp(0.02 * rng.standard_normal()))


@pytest.fixture(scope="module")
def walkers() -> list[FourierWalker]:
    return [walker(seed) for seed in range(14)]


@pytest.fixture(scope="module")
def model(walkers) -> Eigenwalkers:
    return Eigenwalkers(3).fit(walkers)


def matrix(walkers) -> np.ndarray:
    return np.stack([w.coefficients.reshape(-1) for w in walkers])


def test_components_are_the_eigenvectors_of_the_covariance(walkers):
    full = Eigenwalkers().fit(walkers)
    values, vectors = np.linalg.eigh(np.cov(matrix(walkers).T))
    np.testing.assert_allclose(full.explained_variance_, values[::-1][:13], rtol=1e-7, atol=1e-12)
    flat = full.components_.reshape(13, -1)
    np.testing.assert_allclose(np.abs((flat[:5] * vectors.T[::-1][:5]).sum(1)), 1, atol=1e-6)
    np.testing.assert_allclose(flat @ flat.T, np.eye(13), atol=1e-12)
    assert full.explained_variance_ratio_.sum() == pytest.approx(1)
    np.testing.assert_allclose(full.mean_.reshape(-1), matrix(walkers).mean(0), atol=1e-12)
    assert (np.take_along_axis(flat, np.abs(flat).argmax(1)[:, None], 1) > 0).all()


def test_all_components_give_the_walkers_back(walkers):
    full = Eigenwalkers().fit(walkers)
    coefficients = np.stack([w.coefficients for w in walkers])
    np.testing.assert_allclose(full.inverse_transform(full.transform(coefficients)), coefficients, atol=1e-10)
    np.testing.assert_allclose(full.transform(walkers[3]), full.scores_[3], atol=1e-12)


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_transform_undoes_inverse_transform(model, k):
    np.testing.assert_allclose(model.transform(model.inverse_transform(k)), k, atol=1e-9)


def test_transform_is_least_squares_on_what_is_known(model, walkers):
    w = walkers[0].coefficients.copy()
    w[:, [5, 7, 11, 13]] = np.nan
    known = np.isfinite(w).reshape(-1)
    a, b = model.components_.reshape(3, -1)[:, known].T, (w - model.mean_).reshape(-1)[known]
    np.testing.assert_allclose(model.transform(w), np.linalg.lstsq(a, b, rcond=None)[0], atol=1e-9)
    np.testing.assert_array_equal(model.transform(np.full((5, 15, 3), np.nan)), np.zeros(3))


def test_density_of_scores_is_the_gaussian_one(model, walkers):
    k = np.random.default_rng(0).standard_normal((5, 3)) * np.sqrt(model.explained_variance_)
    expected = multivariate_normal(np.zeros(3), np.diag(model.explained_variance_)).logpdf(k)
    np.testing.assert_allclose(model.score_samples(k), expected)
    mean = model.score_samples(model.transform(np.stack([w.coefficients for w in walkers]))).mean()
    assert model.score(walkers) == pytest.approx(mean)


def test_a_person_counts_once(walkers):
    people = ["a", "b", "c", "a", "a", "b", "d"]
    model = Eigenwalkers().fit(walkers[:7], people)
    means = [np.mean([w.coefficients for w, p in zip(walkers, people, strict=False) if p == q], 0) for q in "abcd"]
    again = Eigenwalkers().fit([FourierWalker(centred(in_phase(m)), 1.0) for m in means])
    assert (model.n_people_, model.n_walkers_, model.people_) == (4, 7, ("a", "b", "c", "d"))
    np.testing.assert_allclose(model.mean_, again.mean_, atol=1e-12)
    np.testing.assert_allclose(model.explained_variance_, again.explained_variance_)


def test_the_likelihood_of_complete_walkers_gives_the_same_subspace(walkers):
    """EM, asked to by one hidden coefficient in a thousand, against the SVD of the complete walkers."""
    complete = Eigenwalkers(3).fit(walkers)
    hidden = [*walkers[:-1], hide(walkers[-1], [7])]
    found = Eigenwalkers(3, tol=1e-10).fit(hidden)
    overlap = np.linalg.svd(found.components_.reshape(3, -1) @ complete.components_.reshape(3, -1).T)[1]
    assert overlap.min() > 0.995
    np.testing.assert_allclose(found.explained_variance_, complete.explained_variance_, rtol=0.05)
    np.testing.assert_allclose(found.explained_variance_ratio_, complete.explained_variance_ratio_, atol=0.02)


def hide(walker: FourierWalker, markers) -> FourierWalker:
    coefficients = walker.coefficients.copy()
    coefficients[:, markers] = np.nan
    return FourierWalker(coefficients, walker.frequency)


@settings(max_examples=8)
@given(st.integers(0, 1000))
def test_hidden_markers_are_told_from_the_others(seed):
    """Walkers with an arm or leg hidden: what the model says of it is far nearer the truth than the average walker."""
    rng = np.random.default_rng(seed)
    truth = [walker(100 + s) for s in range(14)]
    chains = [[5, 7], [6, 8], [11, 13], [12, 14]]
    hidden = [chains[rng.integers(4)] for _ in range(7)]
    shown = [hide(w, h) for w, h in zip(truth, hidden, strict=False)] + truth[7:]
    model = Eigenwalkers(3).fit(shown)
    ours = average = 0.0
    for w, part, h in zip(truth, shown, hidden, strict=False):
        told = model.inverse_transform(model.transform(part))
        ours += ((told - w.coefficients)[:, h] ** 2).sum()
        average += ((model.mean_ - w.coefficients)[:, h] ** 2).sum()
    assert ours < 0.1 * average


def test_drawn_walkers_have_the_models_moments(model):
    drawn = model.sample(150, seed=3)
    k = model.transform(drawn)
    error = np.sqrt(model.explained_variance_ / 150)
    assert (np.abs(k.mean(0)) < 5 * error).all()
    np.testing.assert_allclose(k.var(0), model.explained_variance_, rtol=0.5)
    log = np.log([w.frequency for w in drawn])
    assert abs(log.mean() - model.log_frequency_mean_) < 5 * log.std() / 12


def test_frequency_follows_the_scores(model, walkers):
    """Frequency was made to rise with the stride, of which the scores know."""
    told = model.frequency(model.scores_)
    made = np.array([w.frequency for w in walkers])
    assert np.corrcoef(np.log(told), np.log(made))[0, 1] > 0.9
    assert model.log_frequency_deviation_ < 0.6 * np.log(made).std()


def test_frequency_that_has_nothing_to_do_with_scores_is_left_alone(walkers):
    rng = np.random.default_rng(1)
    loose = [FourierWalker(w.coefficients, np.exp(0.1 * rng.standard_normal())) for w in walkers]
    model = Eigenwalkers(3).fit(loose)
    assert np.linalg.norm(model.log_frequency_weights_) < 0.05
    assert model.log_frequency_deviation_ == pytest.approx(np.log([w.frequency for w in loose]).std(), rel=0.3)


def test_same_seed_same_walk(model):
    a, b, c = (model.synthesize_markers(1.0, 30.0, seed=s).positions for s in (7, np.random.default_rng(7), 8))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 1e-3
    first, second = (model.sample(3, seed=5) for _ in range(2))
    assert all((x.coefficients == y.coefficients).all() for x, y in zip(first, second, strict=True))
    np.testing.assert_array_equal(model.synthesize(1.0, seed=7).poses, model.synthesize(1.0, seed=7).poses)


def test_in_place_it_is_equation_3_1(model):
    k = np.sqrt(model.explained_variance_) * [1, -1, 0.5]
    made = model.synthesize_markers(2.0, 50.0, walker=model.walker(scores=k), phase=0.25, overground=False)
    phase = 2 * np.pi * (0.25 + float(model.frequency(k)) * np.arange(100) / 50)
    expected = positions_at(grounded(model.inverse_transform(k)), phase)
    np.testing.assert_allclose(made.positions, expected, atol=1e-9)
    assert made.names == MARKERS


@pytest.mark.parametrize("speed", [0.8, 1.4])
def test_it_walks_as_fast_as_asked_along_x(model, speed):
    positions = model.synthesize_markers(6.0, 60.0, seed=1, speed=speed).positions
    pelvis = positions[:, MARKERS.index("pelvis")]
    assert (pelvis[-1] - pelvis[0])[0] / 5.98 == pytest.approx(speed, rel=0.03)
    assert np.abs(np.polyfit(pelvis[:, 0], pelvis[:, 1], 1)[0]) < 0.03


@pytest.mark.parametrize("seed", range(6))
def test_standing_feet_stay_where_they_are(model, seed):
    motion = model.synthesize(4.0, 120.0, seed=seed)
    nodes, rotations = forward(motion.poses, motion.skeleton)
    ball = (nodes[:, ANKLES] + rotations[:, FEET] @ (FOOT_BALL * motion.skeleton.height))[..., :2]
    standing = np.gradient(ball[..., 0], axis=0).argmin(1)
    steps = np.split(np.arange(len(ball)), np.flatnonzero(np.diff(standing)) + 1)[1:-1]
    assert len(steps) > 4
    drift = [np.linalg.norm(np.ptp(ball[s, standing[s[0]]], axis=0)) for s in steps]
    assert max(drift) < 0.02


def test_the_body_follows_the_markers(model):
    made, motion = model.synthesize_markers(3.0, 60.0, seed=2), model.synthesize(3.0, 60.0, seed=2)
    distance = np.linalg.norm(markers(motion.poses, motion.skeleton) - made.positions, axis=-1)
    assert np.median(distance) < 0.012
    assert motion.fps == 60.0
    assert np.isfinite(motion.poses).all()


def test_the_way_is_smooth_and_adds_up(model):
    walk = gait(model.mean_)
    phase = np.linspace(0, 2 * np.pi, 2001)
    way = walk.way(phase)
    assert np.hypot(*(way[-1] - way[0])) == pytest.approx(walk.stride_length)
    np.testing.assert_allclose(walk.way(phase + 2 * np.pi) - way, np.broadcast_to(way[-1], way.shape), atol=1e-12)
    jumps = np.diff(way, n=3, axis=0) / (phase[1] ** 3)
    assert np.abs(jumps).max() < 100


def test_saved_and_loaded_it_is_the_same(model, tmp_path):
    model.save(tmp_path / "walkers.npz", card={"people": 14})
    same = load(tmp_path / "walkers.npz")
    assert (same.n_people_, same.n_walkers_, same.card_) == (14, 14, {"people": 14})
    np.testing.assert_array_equal(same.synthesize(1.0, seed=4).poses, model.synthesize(1.0, seed=4).poses)


def test_a_model_file_with_other_shapes_is_refused(model, tmp_path):
    arrays, meta = model.to_arrays()
    save_model(tmp_path / "bad.npz", "eigenwalkers", arrays | {"mean_": np.zeros((5, 14, 3))}, meta)
    with pytest.raises(ModelError, match=r"mean_ has shape \(5, 14, 3\)"):
        load(tmp_path / "bad.npz")


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda m, w: m.synthesize(0.0), "seconds"),
        (lambda m, w: m.synthesize(1.0, fps=-3.0), "fps"),
        (lambda m, w: m.synthesize(1.0, speed=20.0), "speed"),
        (lambda m, w: m.synthesize_markers(1.0, walker=m.walker(scores=[1.0] * 9)), "scores"),
        (lambda m, w: m.sample(0), "n must"),
        (lambda m, w: m.transform(np.zeros((5, 45))), "5, 15, 3"),
        (lambda m, w: Eigenwalkers().fit(w[:1]), "at least two people, got 1"),
        (lambda m, w: Eigenwalkers(9).fit(w[:4]), "1 to 3 eigenwalkers"),
        (lambda m, w: Eigenwalkers().fit(w[:4], ["a"] * 4), "at least two people, got 1"),
        (lambda m, w: Eigenwalkers().fit(w[:4], ["a"]), "subject"),
        (lambda m, w: Eigenwalkers().fit([1, 2]), "Markers"),
        (lambda m, w: Eigenwalkers(1).fit([hide(a, [7]) for a in w]), "left_wrist"),
    ],
)
def test_what_makes_no_sense_is_refused(model, walkers, call, says):
    with pytest.raises(MotionError, match=says):
        call(model, walkers)


def test_before_fit_and_with_gaps_there_is_no_walk(walkers):
    with pytest.raises(ModelError, match="not fitted"):
        Eigenwalkers().sample(1)
    with pytest.raises(GapError, match="left_wrist"):
        gait(hide(walkers[0], [7]).coefficients)


def test_frequencies_that_nothing_can_be_learned_of_do_not_hang_on_rounding():
    """With R - 1 components every penalty predicts left-out people as well; then the pace doesn't follow the scores."""
    rng = np.random.default_rng(1)
    z = np.linalg.qr(np.column_stack([np.ones(8), rng.standard_normal((8, 7))]))[0][:, 1:] * np.sqrt(7)
    y = rng.standard_normal(8)
    for turned in (z, z @ np.linalg.qr(rng.standard_normal((7, 7)))[0]):
        mean, weights, _ = shrunk_regression(turned, y)
        assert np.abs(weights).max() < 1e-2
        assert mean == pytest.approx(y.mean())
