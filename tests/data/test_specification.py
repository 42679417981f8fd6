"""Specifications, and the records that they are."""

import json
import tomllib

import pytest

from motionenv.data import PRESETS, Specification
from motionenv.data.record import Record
from motionenv.data.specification import preset
from motionenv.data.stimuli import StimulusSet
from motionenv.errors import MotionError


@pytest.mark.parametrize("name", PRESETS)
def test_a_specification_survives_json_and_says_the_same_hash(name, tmp_path):
    spec = Specification.read(name)
    (tmp_path / "spec.json").write_text(spec.json())
    again = Specification.read(tmp_path / "spec.json")
    assert (again, again.hash) == (spec, spec.hash)
    assert Specification.of(tomllib.loads(preset(name))) == spec


def test_the_hash_knows_every_part_but_how_much_and_the_seed():
    spec = Specification()
    assert spec.replace(frames=7, seed=3).hash == spec.hash
    changed = [
        {"clip": 2}, {"fps": 25}, {"people": {"turning": 0.1}}, {"cameras": {"follow": 0.1}},
        {"pictures": {"noise": 1}}, {"output": {"picture": "webp"}},
    ]  # fmt: skip
    assert len({spec.hash, *(spec.replace(**each).hash for each in changed)}) == 1 + len(changed)


def test_shards_cut_the_indices_without_gap_or_overlap():
    spec = Specification(frames=1003, clip=4, output={"shard": 50})
    assert [i for shard in range(spec.shards) for i in spec.range_of(shard)] == list(range(251))
    with pytest.raises(MotionError, match=f"shard must be from 0 to {spec.shards - 1}, got {spec.shards}"):
        spec.range_of(spec.shards)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ({"peple": {}}, "specification: peple: there is no such field: did you mean people"),
        ({"people": {"speed": [2, 1]}}, r"people.speed: must be two numbers in order from 0.1 to 3; got \[2, 1\]"),
        ({"frames": 0}, "frames: Input should be greater than or equal to 1; got 0"),
        ({"pictures": {"background": "black", "noise": 3}}, 'background "black" takes no objects'),
        ({"output": {"fields": ["rgb", "rgb"]}}, "none twice"),
        ({"output": {"fields": ["colour"]}}, "output.fields.0: Input should be 'rgb'"),
        ({"clip": 90_000}, "clip must last 60 s at most"),
    ],
)
def test_what_is_wrong_is_named(content, told):
    with pytest.raises(MotionError, match=told):
        Specification.of(content)


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("spec.yaml", "", "a specification is a .toml or .json file, or one of keypoints"),
        ("spec.toml", "frames = ", "spec.toml isn't TOML"),
        ("spec.json", "{", "spec.json isn't JSON"),
    ],
)
def test_files_that_are_none(tmp_path, name, text, told):
    (tmp_path / name).write_text(text)
    with pytest.raises(MotionError, match=told):
        Specification.read(tmp_path / name)


def test_missing_files_and_presets():
    with pytest.raises(MotionError, match="can't read missing.toml: No such file"):
        Specification.read("missing.toml")
    with pytest.raises(MotionError, match="there is no preset 'walks': keypoints"):
        preset("walks")


def test_the_schema_accepts_what_it_describes():
    from jsonschema import Draft202012Validator

    checks = Draft202012Validator(Specification.schema())
    for name in PRESETS:
        checks.validate(json.loads(Specification.read(name).json()))
    assert not checks.is_valid({"frames": "many"})


@pytest.mark.parametrize("kind", [Specification, StimulusSet])
def test_every_field_of_a_schema_is_described(kind: type[Record]):
    schema = kind.model_json_schema()
    for part in (schema, *schema["$defs"].values()):
        for name, field in part["properties"].items():
            assert "$ref" in field or len(field["description"]) > 5, name
