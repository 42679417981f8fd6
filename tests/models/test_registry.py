"""Names of models, and what is said of those that are none."""

import pytest

import motionenv
from motionenv import models
from motionenv.errors import ModelError, MotionError
from motionenv.models import registry


def test_our_models_are_listed_by_name_and_their_cards_told_without_loading():
    assert {"mixed/tree", "walk/eigenwalkers", "walk/fpca", "walk/prior"} <= set(models.names())
    for name in models.names():
        assert models.card(name)["model"] == name
    assert [name for name in models.names() if models.takes_long(name)] == ["mixed/tree"]


@pytest.mark.parametrize(("wrong", "meant"), [("walk/fcpa", "walk/fpca"), ("eigenwalkers", "walk/eigenwalkers")])
def test_a_name_that_is_nearly_one_brings_a_suggestion(wrong, meant):
    for ask in (motionenv.load, models.card, lambda name: motionenv.synthesize(name, 1, 30)):
        with pytest.raises(ModelError, match=f"did you mean {meant}\\?"):
            ask(wrong)


def test_a_name_that_is_like_none_brings_no_suggestion():
    with pytest.raises(ModelError) as error:
        motionenv.load("nothing like it")
    assert "did you mean" not in str(error.value)
    assert all(name in str(error.value) for name in models.names())


def test_what_makes_no_motion_is_refused_by_what_it_is():
    with pytest.raises(MotionError, match="is a fpca model, which makes no motion"):
        models.gait_model(motionenv.load("walk/fpca").fpca_)
    with pytest.raises(MotionError, match="is a int model"):
        models.gait_model(3)


def test_without_its_entry_points_motionenv_says_how_to_get_them(monkeypatch):
    monkeypatch.setattr(registry, "entry_points", lambda group: [])
    registry._entries.cache_clear()
    try:
        with pytest.raises(ModelError, match="reinstall it"):
            models.names()
    finally:
        registry._entries.cache_clear()
