"""What is told of models fits its schemas, without anything missing or lost."""

import pytest
from pydantic import BaseModel

from service.schemas.models import Component, ModelDescription, ModelList
from tests.service.inside import answers

PATHS: dict[str, type[BaseModel]] = {
    "/v1/models": ModelList, "/v1/models/walk/fpca": ModelDescription, "/v1/models/walk/eigenwalkers": ModelDescription,
}  # fmt: skip


@pytest.fixture(scope="module")
def told(tmp_path_factory) -> dict:
    found = answers(tmp_path_factory.mktemp("data"), [("GET", path, {}) for path in PATHS])
    return {path: answer.raise_for_status().json() for path, answer in zip(PATHS, found, strict=True)}


@pytest.mark.parametrize("path", PATHS)
def test_an_answer_is_its_schema_and_nothing_else(told, path):
    assert PATHS[path].model_validate(told[path]).model_dump(mode="json") == told[path]


def test_shares_and_deviations_are_what_they_are_called():
    with pytest.raises(ValueError, match="greater than or equal to 0"):
        Component(name="component 1", deviation=-1.0, mean=0.0)
    with pytest.raises(ValueError, match="less than or equal to 1"):
        Component(name="component 1", deviation=1.0, mean=0.0, share=1.1)


def test_shares_of_all_components_sum_to_one_at_most(told):
    described = ModelDescription(**told["/v1/models/walk/eigenwalkers"])
    assert 0.5 < sum(component.share for component in described.components) <= 1 + 1e-9
