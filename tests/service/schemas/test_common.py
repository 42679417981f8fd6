"""What every request has in common: strict types, known names, finite numbers."""

import pytest
from pydantic import TypeAdapter, ValidationError

import motionenv
from motionenv.models import names
from service.schemas.common import ModelName, Request, Seed

NAME, SEED = TypeAdapter(ModelName), TypeAdapter(Seed)


class Asked(Request):
    speed: float = 1.0
    n: int = 1


@pytest.mark.parametrize(
    ("body", "field", "says"),
    [
        ('{"speed": "1"}', "speed", "valid number"),
        ('{"speed": NaN}', "speed", "finite number"),
        ('{"speed": 1e999}', "speed", "finite number"),
        ('{"n": 1.5}', "n", "integer"),
        ('{"n": true}', "n", "integer"),
        ('{"pace": 1}', "pace", "not permitted"),
    ],
)
def test_what_is_no_number_or_not_known_is_refused_by_name(body, field, says):
    with pytest.raises(ValidationError, match=says) as refused:
        Asked.model_validate_json(body)
    assert refused.value.errors()[0]["loc"] == (field,)


def test_a_request_does_not_change():
    with pytest.raises(ValidationError, match="frozen"):
        Asked().speed = 2.0


def test_every_model_that_there_is_has_a_name_that_is_taken():
    for name in (*names(), "fitted/my-walk", "fitted/" + "a" * 63):
        assert NAME.validate_python(name) == name
    for name in ("fpca", "walk/", "/x", "../x", "walk/..", "a/b/c", "Walk/fpca", "walk/fpca\n", "fitted/" + "a" * 64):
        with pytest.raises(ValidationError, match="pattern"):
            NAME.validate_python(name)


def test_every_seed_that_is_taken_is_one_of_the_library():
    for seed in (0, 2**63 - 1):
        taken = SEED.validate_python(seed)
        assert motionenv.synthesize("walk/fpca", 0.1, 30, seed=taken).poses.shape == (3, 25)
    assert SEED.validate_python(None) is None
    for seed in (-1, 2**63):
        with pytest.raises(ValidationError, match="Input should be"):
            SEED.validate_python(seed)
