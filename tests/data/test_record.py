import pytest

from motionenv.data import Specification
from motionenv.data.record import Record, read_content
from motionenv.data.stimuli import StimulusSet
from motionenv.errors import MotionError


@pytest.mark.parametrize("kind", [Specification, StimulusSet])
def test_every_field_of_a_schema_is_described(kind: type[Record]):
    schema = kind.model_json_schema()
    for part in (schema, *schema["$defs"].values()):
        for name, field in part["properties"].items():
            assert "$ref" in field or len(field["description"]) > 5, name


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.txt", "", "a file, please; got"),
        ("a.toml", "x = ", "isn't TOML"),
        ("a.json", "{", "isn't JSON"),
        ("none.json", None, "can't read"),
    ],
)
def test_files_that_hold_nothing_are_told(tmp_path, name, text, told):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(MotionError, match=told):
        read_content(tmp_path / name, "a file, please")
