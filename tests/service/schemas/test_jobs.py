"""Fields of jobs name what the library and the service have: kinds, units, formats, names of models."""

from pathlib import Path
from typing import get_args

import pytest
from pydantic import ValidationError

from motionenv.mocap.units_axes import METRES
from motionenv.models.training import MODELS
from service.formats import FILES, FILMS, JSON, PNG
from service.jobs.store import WAITING, Job
from service.jobs.tasks import KINDS
from service.model_registry import ModelRegistry
from service.schemas.jobs import ConvertFields, FitFields, JobStatus, Kind, ReadFields, RenderRequest, Status


def choices(model, field: str) -> set:
    """Values of a field that is a choice, which may be left out."""
    told = model.model_fields[field].annotation
    options = get_args(told)
    return {value for option in options for value in (get_args(option) or (option,))} - {type(None)}


def test_what_may_be_chosen_is_what_there_is():
    assert choices(ReadFields, "unit") == set(METRES)
    assert choices(ConvertFields, "format") == {JSON, *FILES}
    assert choices(RenderRequest, "format") == set(FILMS) - {PNG}
    assert set(get_args(Kind)) == set(KINDS)
    assert {f"walk/{kind}" for kind in choices(FitFields, "kind") - {"tree"}} <= set(MODELS)
    assert {*WAITING, "done"} < set(get_args(Status))


@pytest.mark.parametrize("name", ["a", "my-walk", "0", "a" * 63])
def test_a_model_of_every_name_that_is_taken_has_a_file(name):
    asked = FitFields(kind="fpca", name=name)
    registry = ModelRegistry(Path("models"))
    assert registry.place(f"fitted/{asked.name}", "") == Path("models") / f"{name}.npz"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("name", ""), ("name", "A"), ("name", "-a"), ("name", "a/b"), ("name", "a" * 64), ("name", "a\n"),
        ("kind", "pca"), ("fps", 0.5), ("fps", "nan"), ("fps", "many"), ("unit", "parsec"), ("activity", ""),
        ("activity", "a\tb"), ("mirrored", "perhaps"), ("speed", "1"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_by_its_field(field, value):
    with pytest.raises(ValidationError) as refused:
        FitFields(**{"kind": "tree", "name": "mine", field: value})
    assert refused.value.errors()[0]["loc"] == (field,)


def test_fields_of_a_form_are_text_and_become_numbers():
    asked = FitFields.model_validate({"kind": "tree", "name": "mine", "fps": "120", "mirrored": "true"})
    assert (asked.fps, asked.mirrored, asked.unit) == (120.0, True, None)


def test_a_job_as_it_is_stored_has_what_its_state_tells():
    told = set(JobStatus.model_fields)
    assert told - {field for field in Job.__dataclass_fields__} == {"files"}
