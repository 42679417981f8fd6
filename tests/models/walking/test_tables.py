"""What synthesis takes from a fitted model before it draws anybody."""

import numpy as np
import pytest

from motionenv.models import load
from motionenv.models.walking.tables import floors_of, root_of, tables_of


@pytest.fixture(scope="module")
def model():
    return load("walk/fpca")


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


def test_the_body_has_the_models_proportions_and_height(model):
    body = tables_of(model).body
    assert body.height == model.height_
    np.testing.assert_allclose(body.offsets / body.height, model.proportions_, rtol=1e-12)


def test_floors_are_percentiles_of_the_ankles_heights(model):
    scores = model.sample(5, seed=0).scores
    heights = model.fpca_.inverse_transform(scores)[..., 22:]
    np.testing.assert_allclose(floors_of(tables_of(model), scores), np.percentile(heights, 10, axis=1), atol=1e-12)
