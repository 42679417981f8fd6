"""What a walking model learns of people, and from a single walk."""

import numpy as np
import pytest

import motionenv
from motionenv import WalkingModel
from motionenv.models import cycle
from motionenv.models.walking.model import _even
from motionenv.models.walking.tables import floors_of, root_of, tables_of


@pytest.fixture(scope="module")
def model():
    return motionenv.load("walk/fpca")


def test_it_knows_how_long_strides_are(model):
    """Log stride lengths within 3 % of those of walking in place, of people who were not drawn to learn it."""
    scores = model.sample(60, seed=11).scores
    walkers = [motionenv.Walker(model.kind, tuple(each)) for each in scores]  # each at the pace of the scores
    lengths = np.log([cycle(model, walker=each).stride / model.height_ for each in walkers])
    assert (model.pace_.log_length(model.standard(scores)) - lengths).std() < 0.03


def test_knees_bend_with_speed_as_in_published_walks(model):
    """About 15° per log stride length at the knee's greatest flexion, where its curve is steep in no direction."""
    z = np.zeros((1, 8))
    longer, shorter = (model.pace_.longer(z, change, model.pace_.direction) for change in (0.1, -0.1))
    walkers = [motionenv.Walker(model.kind, model.walker(deviations=each[0]).scores) for each in (longer, shorter)]
    peaks = [np.degrees(cycle(model, walker=each).poses[:, [20, 24]].max(axis=0).mean()) for each in walkers]
    assert (peaks[0] - peaks[1]) / 0.2 == pytest.approx(15, abs=8)


def test_walks_that_start_or_stop_do_not_tell_how_cycles_vary():
    rng = np.random.default_rng(0)
    even = [rng.standard_normal((6, 3)) for _ in range(12)]
    even = [trial - trial.mean(axis=0) for trial in even]
    uneven = 20 * (np.arange(6) - 2.5)[:, None] * np.ones(3)
    np.testing.assert_allclose(_even([*even, uneven]), _even(even))
    np.testing.assert_allclose(_even(even), np.eye(3), atol=0.5)


@pytest.fixture(scope="module")
def walks():
    return [motionenv.synthesize("walk/fpca", 9, 60, seed=seed, speed=1.2) for seed in (3, 4)]


@pytest.mark.parametrize("count", [1, 2])
def test_a_model_of_one_walk_or_two_walks_like_them(walks, count, tmp_path):
    model = WalkingModel().fit(walks[:count], ["somebody"] * count)
    assert 1 <= model.fpca_.n_components <= 8
    model.save(tmp_path / "one.npz")
    loaded = motionenv.load(tmp_path / "one.npz")
    mean = loaded.person_mean_[:-2]
    assert float(loaded.stride_seconds(mean)) == pytest.approx(np.exp(loaded.person_mean_[-2]))
    assert cycle(loaded, walker=motionenv.Walker("walking", tuple(mean))).speed == pytest.approx(1.2, abs=0.1)
    for options in ({}, {"speed": 1.5}, {"deviations": [1.0]}):
        assert np.isfinite(motionenv.synthesize(loaded, 2, 30, seed=1, **options).poses).all()


def test_what_a_model_of_one_walk_tells_clients_is_finite(walks):
    arrays, _ = motionenv.models.parameters(WalkingModel().fit(walks[:1], ["somebody"]))
    assert all(np.isfinite(array).all() for array in arrays.values())


@pytest.mark.parametrize("rank", [1, 3, 5])
def test_a_root_of_a_covariance_gives_it_back_and_is_symmetric(rank):
    factor = np.random.default_rng(rank).normal(size=(5, rank))
    covariance = factor @ factor.T
    root = root_of(covariance)
    np.testing.assert_allclose(root @ root, covariance, atol=1e-12)
    np.testing.assert_allclose(root, root.T, atol=1e-14)
    assert np.linalg.matrix_rank(root) == rank  # the roots of rounding errors would count


def test_people_drawn_by_the_tables_vary_as_the_model_says(model):
    tables = tables_of(model)
    people, covariance = tables.people, model.person_covariance_
    np.testing.assert_allclose(people @ people.T, covariance[:-1, :-1], atol=1e-12)
    # The regression of the stride time on the scores explains what they have in common.
    shared = covariance[:-2, :-2] @ tables.pace
    np.testing.assert_allclose(shared, covariance[:-2, -2], atol=1e-9)


def test_floors_are_percentiles_of_the_ankles_heights(model):
    scores = model.sample(5, seed=0).scores
    heights = model.fpca_.inverse_transform(scores)[..., 22:]
    np.testing.assert_allclose(floors_of(tables_of(model), scores), np.percentile(heights, 10, axis=1), atol=1e-12)
