"""The number of components, and scikit-learn's tools around the model."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import make_pipeline

from motionenv.errors import MotionError
from motionenv.models.fpca.model import FunctionalPCA
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps


@pytest.fixture(scope="module")
def cycles():
    """Sixty cycles with gaps of three components of 12 people, whose own scores are most of their cycles'."""
    return as_cycles(with_gaps(low_rank(noise=0.3)[0])[0], tuple(f"p{i % 12}" for i in range(60)))


def test_people_left_out_are_most_likely_with_as_many_components_as_there_are(cycles):
    model = FunctionalPCA("likelihood", n_harmonics=10).fit(cycles)
    curve = model.selection_
    assert model.n_components_ == curve.best == 3
    assert curve.n_components.tolist() == list(range(1, 7))  # three more were no better
    assert (curve.error >= 0).all()
    assert curve.error[2] == 0
    alone = FunctionalPCA(3, n_harmonics=10).fit(cycles)
    np.testing.assert_array_equal(alone.components_, model.components_)
    assert alone.selection_ is None


def test_the_held_out_score_is_that_of_models_of_the_others(cycles):
    model = FunctionalPCA("likelihood", n_harmonics=10).fit(cycles)
    folds = np.unique(cycles.subject, return_inverse=True)[1] % 10
    expected = []
    for fold in range(10):
        others = FunctionalPCA(3, n_harmonics=10, tol=1e-4).fit(cycles.values[folds != fold])
        own = cycles.values[folds == fold]
        expected.append(np.median(others.score_samples(own) / np.isfinite(own).sum(axis=(1, 2))))
    assert model.selection_.score[2] == pytest.approx(np.mean(expected))


@pytest.mark.parametrize("share", [0.3, 0.75])
def test_a_share_of_variance_takes_the_fewest_components_that_have_it(cycles, share):
    model = FunctionalPCA(share, n_harmonics=10).fit(cycles)
    assert model.explained_variance_ratio_.sum() >= share - 1e-3
    q = model.n_components_
    assert q == 1 or FunctionalPCA(q - 1, n_harmonics=10).fit(cycles).explained_variance_ratio_.sum() < share + 1e-3


def test_a_share_that_noise_leaves_to_no_components_is_refused(cycles):
    with pytest.raises(MotionError, match="59 components, the most there can be, have less than 95% of the var"):
        FunctionalPCA(0.95, n_harmonics=10).fit(cycles)


def test_a_chosen_number_of_components_is_stored(cycles, tmp_path):
    from motionenv.models.registry import load

    model = FunctionalPCA(0.75, n_harmonics=10).fit(cycles)
    model.save(tmp_path / "model.npz")
    again = load(tmp_path / "model.npz")
    assert (again.n_components, again.n_components_) == (0.75, model.n_components_)


def test_scikit_learn_clones_searches_and_validates(cycles):
    model = FunctionalPCA(2, n_harmonics=8)
    twin = clone(model).set_params(n_components=4)
    assert (twin.n_components, twin.n_harmonics, model.n_components) == (4, 8, 2)
    people = np.array(cycles.subject)
    for given in (cycles, cycles.values):
        scores = cross_val_score(model, given, groups=people, cv=GroupKFold(4))
        folds = GroupKFold(4).split(cycles.values, groups=people)
        expected = [FunctionalPCA(2, n_harmonics=8).fit(cycles.values[a]).score(cycles.values[b]) for a, b in folds]
        np.testing.assert_allclose(scores, expected)
    search = GridSearchCV(model, {"n_components": [1, 3]}, cv=GroupKFold(4)).fit(cycles.values, groups=people)
    assert search.best_params_ == {"n_components": 3}


def test_a_pipeline_predicts_from_scores(cycles):
    target = np.arange(60.0)
    line = make_pipeline(FunctionalPCA(3, n_harmonics=10), LinearRegression()).fit(cycles, target)
    scores = FunctionalPCA(3, n_harmonics=10).fit(cycles).transform(cycles)
    np.testing.assert_allclose(line.predict(cycles), LinearRegression().fit(scores, target).predict(scores))


def test_settings_that_do_not_exist_are_refused():
    with pytest.raises(MotionError, match="FunctionalPCA has no setting n_component: it has n_components, n_harmonics"):
        FunctionalPCA().set_params(n_component=3)


def test_people_of_an_array_can_be_told(cycles):
    own = FunctionalPCA(2, n_harmonics=8, centre="subject").fit(cycles.values, subjects=cycles.subject)
    np.testing.assert_array_equal(own.mean_, FunctionalPCA(2, n_harmonics=8, centre="subject").fit(cycles).mean_)
    with pytest.raises(MotionError, match="subjects must label 60 cycles, got 2"):
        FunctionalPCA().fit(cycles.values, subjects=["a", "b"])


def test_bands_of_the_mean_hold_that_of_all_people():
    """Of many draws of 12 people with five cycles each, whose means differ; also all phases of a channel at once."""
    rng, inside, whole = np.random.default_rng(0), [], []
    basis = np.cos(2 * np.pi * np.arange(32) / 32)[:, None] * [1.0, 0.0] + np.array([0.3, 1.0])
    for _ in range(150):
        own = np.repeat(rng.standard_normal((12, 1, 2)), 5, axis=0)
        values = basis * (1 + own) + 0.3 * rng.standard_normal((60, 32, 2))
        model = FunctionalPCA(2, n_harmonics=4, residual_harmonics=0, tol=1e-3)
        model.fit(values, subjects=np.repeat(np.arange(12), 5))
        off = np.abs(model.mean_ - basis)
        inside.append((off <= model.mean_band(0.9)).mean())
        whole.append((off <= model.mean_band(0.9, simultaneous=True, seed=1)).all(axis=0).mean())
    assert np.mean(inside) == pytest.approx(0.9, abs=0.04)
    assert np.mean(whole) == pytest.approx(0.9, abs=0.04)


def test_one_person_tells_nothing_of_others(cycles):
    model = FunctionalPCA(2, n_harmonics=8).fit(cycles.values, subjects=["one"] * 60)
    assert np.isnan(model.mean_band()).all()
