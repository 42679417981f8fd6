"""Models are described as they are, and nothing is promised that requests refuse."""

import pytest

import motionenv
from motionenv.models import card
from service.formats.models import description, summary
from service.schemas.stream import StreamSettings
from service.schemas.synthesis import SynthesisRequest


@pytest.fixture(scope="module")
def model():
    return motionenv.load("walk/fpca")


def test_a_summary_tells_what_the_card_says(model):
    told, known = summary("walk/fpca", model, None), card("walk/fpca")
    assert (told.name, told.kind, told.ready, told.problem) == ("walk/fpca", "walking", True, None)
    assert told.licence == known["model licence"]
    assert known["data"] in told.summary
    assert known["intended use"] in told.summary


def test_a_model_that_is_not_there_yet_is_told_from_its_card():
    told = description("mixed/tree", None, None)
    assert (told.kind, told.ready, told.synthesis, told.components) == (None, False, False, [])
    assert told.card == card("mixed/tree")


def test_one_that_can_not_be_loaded_says_why():
    told = summary("fitted/broken", None, "the file is damaged")
    assert (told.ready, told.problem, told.summary, told.licence) == (False, "the file is damaged", "", None)


def test_one_without_a_card_is_told_without_it():
    told = description("fitted/mine", None, None)
    assert (told.card, told.summary) == ({}, "")


@pytest.mark.parametrize("name", ["walk/fpca", "walk/eigenwalkers"])
def test_ranges_are_those_of_requests(name):
    fields = SynthesisRequest.model_json_schema()["properties"]
    ranges = description(name, motionenv.load(name), None).ranges
    assert {"speed", "height", "deviations", "seconds", "fps"} <= set(ranges)
    for field, told in ranges.items():
        options = [fields[field], *fields[field].get("anyOf", ())]
        options += [option["items"] for option in options if "items" in option]
        (bounds,) = [option for option in options if "maximum" in option]
        assert told.maximum == bounds["maximum"]
        assert told.minimum == bounds.get("minimum", bounds.get("exclusiveMinimum"))
    stream = StreamSettings.model_json_schema()["properties"]["speed"]["anyOf"][0]
    assert (stream["minimum"], stream["maximum"]) == (ranges["speed"].minimum, ranges["speed"].maximum)
