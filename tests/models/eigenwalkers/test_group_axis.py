"""An axis between groups points from one to the other, and tells left-out people apart only if they differ."""

import numpy as np
import pytest

import motionenv
from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.group_axis import checked_groups
from motionenv.models.eigenwalkers.model import Eigenwalkers


def people(apart: float, n: int = 12, seed: int = 0) -> tuple[list[FourierWalker], dict[str, list[str]], np.ndarray]:
    """Walkers of a shipped model whose second half is shifted by `apart` deviations; the groups, and that direction."""
    model = motionenv.load("walk/eigenwalkers")
    rng = np.random.default_rng(seed)
    q = len(model.components_)
    direction = rng.standard_normal(q)
    direction /= np.linalg.norm(direction)
    z = rng.standard_normal((2 * n, q))
    z[n:] += apart * direction
    w = model.inverse_transform(z * np.sqrt(model.explained_variance_))
    groups = {"these": [f"p{i}" for i in range(n)], "those": [f"p{i}" for i in range(n, 2 * n)]}
    change = np.tensordot(direction * np.sqrt(model.explained_variance_), model.components_, axes=1)
    return [FourierWalker(one, 1.0) for one in w], groups, change


def fitted(apart: float, **how) -> tuple[Eigenwalkers, np.ndarray]:
    walkers, groups, change = people(apart, **how)
    return Eigenwalkers().fit(walkers, [f"p{i}" for i in range(len(walkers))], groups=groups), change


def test_it_points_from_one_group_to_the_other_and_tells_people_apart():
    model, change = fitted(5.0, n=15)
    axis = model.axis_
    step = np.tensordot(axis.direction * np.sqrt(model.explained_variance_), model.components_, axes=1)
    cosine = (step * change).sum() / np.linalg.norm(step) / np.linalg.norm(change)
    assert len(model.components_) == 10  # 30 people who differ along 10 directions
    assert cosine > 0.55  # chance: 0.3
    assert sum(axis.right) >= 26
    assert axis.people == (15, 15)
    place = axis.mean + axis.gain * (model.scores_ / np.sqrt(model.explained_variance_)) @ axis.direction
    assert place[:15].mean() == pytest.approx(-1)
    assert place[15:].mean() == pytest.approx(1)


def test_groups_that_are_none_are_not_told_apart():
    """People drawn alike: about half fall right, however well the axis fits those it was learned from."""
    right, place = [], []
    for seed in range(8):
        model, _ = fitted(0.0, n=10, seed=seed)
        right.append(sum(model.axis_.right))
        z = model.scores_ / np.sqrt(model.explained_variance_)
        place.append(np.mean((z @ model.axis_.direction > -model.axis_.mean / model.axis_.gain)[10:]))
    assert 0.3 < np.mean(right) / 20 < 0.7
    assert np.mean(place) > 0.7  # those that it was learned from


def test_it_is_a_trait_and_is_kept_in_the_file(tmp_path):
    model, _ = fitted(4.0)
    model.save(tmp_path / "model.npz")
    again = motionenv.load(tmp_path / "model.npz")
    trait, kept = model.traits()[0], again.traits()[0]
    assert (kept.name, kept.low, kept.high, kept.note) == ("these or those", "these", "those", trait.note)
    np.testing.assert_array_equal(kept.direction, trait.direction)
    assert np.linalg.norm(kept.direction) == pytest.approx(1)
    assert "Left out of the fit" in kept.note
    assert motionenv.models.parameters(again)[1]["traits"][0]["note"] == trait.note
    plain = Eigenwalkers().fit(people(4.0)[0])
    assert plain.axis_ is None
    assert "these" not in [one.low for one in plain.traits()]


@pytest.mark.parametrize(
    ("groups", "why"),
    [
        ({"a": ["p0", "p1"]}, "between two groups with names, got 1"),
        ({"a": ["p0", "p1"], "b": ["p1", "p2"]}, "p1 can't be in both groups, a and b"),
        ({"a": ["p0", "p1"], "b": ["p2", "x"]}, "no walk of x can be used for an axis: there are walks of p0, p1"),
        ({"a": ["p0"], "b": ["p2", "p1"]}, "group a needs at least 2 people, got 1"),
        ({"a": ["p0", "p0"], "b": ["p2", "p1"]}, "group a needs at least 2 people, got 1"),
        ({"a": ["p0", "p1"], "": ["p2", "p3"]}, "two groups with names"),
    ],
)
def test_what_are_no_two_groups_is_told(groups, why):
    with pytest.raises(MotionError, match=why):
        checked_groups(groups, ["p0", "p1", "p2", "p3"])


def test_people_of_neither_group_help_the_model_only():
    walkers, groups, _ = people(3.0, n=8)
    labels = [f"p{i}" for i in range(16)]
    few = {name: members[:5] for name, members in groups.items()}
    model = Eigenwalkers().fit(walkers, labels, groups=few)
    assert model.axis_.people == (5, 5)
    assert model.n_people_ == 16
