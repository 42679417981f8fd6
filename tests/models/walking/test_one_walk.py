"""A model of one walk alone: it varies as that walk's strides do, and says so little about others as it knows."""

import numpy as np
import pytest

import motionenv
from motionenv import WalkingModel
from motionenv.models.treadmill_cycle import walk_in_place


@pytest.fixture(scope="module")
def walks():
    return [motionenv.synthesize("walk/fpca", 9, 60, seed=seed, speed=1.2) for seed in (3, 4)]


@pytest.mark.parametrize("count", [1, 2])
def test_it_walks_like_what_it_has_seen(walks, count, tmp_path):
    model = WalkingModel().fit(walks[:count], ["somebody"] * count)
    assert 1 <= model.fpca_.n_components <= 8
    model.save(tmp_path / "one.npz")
    loaded = motionenv.load(tmp_path / "one.npz")
    mean = loaded.person_mean_[:-2]
    assert float(loaded.stride_seconds(mean)) == pytest.approx(np.exp(loaded.person_mean_[-2]))
    assert float(walk_in_place(loaded, mean).speeds) == pytest.approx(1.2, abs=0.1)
    for options in ({}, {"speed": 1.5}, {"deviations": [1.0]}):
        assert np.isfinite(motionenv.synthesize(loaded, 2, 30, seed=1, **options).poses).all()


def test_what_it_shares_with_the_page_is_finite(walks):
    arrays, _ = motionenv.models.parameters(WalkingModel().fit(walks[:1], ["somebody"]))
    assert all(np.isfinite(array).all() for array in arrays.values())
