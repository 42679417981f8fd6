"""What may be asked of a gait, and that reports are as their schema says."""

import json

import pytest
from pydantic import ValidationError

import motionenv
from motionenv.gait import Session, analyse, shipped_band
from motionenv.gait.report import to_json
from service.schemas.gait import GaitReport, GaitRequest


def test_a_report_is_as_its_schema_says():
    walk = motionenv.synthesize("walk/fpca", 6, 100, seed=1)
    told = json.loads(to_json(Session((analyse(walk),), {}, shipped_band())))
    assert json.loads(GaitReport.model_validate(told, strict=False).model_dump_json()) == told


@pytest.mark.parametrize(("field", "value"), [("seconds", 1.9), ("fps", 29), ("seconds", 601), ("fps", 241)])
def test_bounds(field, value):
    with pytest.raises(ValidationError, match=field):
        GaitRequest(**{field: value})
