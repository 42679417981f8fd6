"""Requests allow what the library takes and refuse the rest by field; responses are as their schemas say."""

import json
import math
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

import motionenv
from motionenv import MotionError
from motionenv.data.stimuli import StimulusSet
from motionenv.gait import Session, analyse, shipped_band
from motionenv.gait.report import to_json
from motionenv.lifting import project_markers
from motionenv.mocap.units_axes import METRES
from motionenv.models import Target, names
from motionenv.models.motion_tree import Clip, MotionTree, build_database
from motionenv.models.training import MODELS
from motionenv.types import MARKERS, POSE
from service.formats import FILES, FILMS, JSON, PNG
from service.formats.films import arguments
from service.jobs.store import WAITING, Job
from service.jobs.tasks import KINDS
from service.model_registry import ModelRegistry
from service.responses.streaming import Stream
from service.routes.lift import to_response
from service.schemas.common import ModelName, Seed
from service.schemas.gait import GaitReport, GaitRequest
from service.schemas.jobs import ConvertFields, FitFields, JobStatus, Kind, ReadFields, RenderRequest, Status
from service.schemas.lift import LiftRequest, LiftResponse
from service.schemas.models import Component, ModelDescription, ModelList
from service.schemas.stimuli import StimuliRequest
from service.schemas.stream import StreamSettings
from service.schemas.synthesis import Picture, SynthesisRequest
from service.schemas.tree import SamplesRequest, TreeSynthesisRequest
from tests.models.eigenwalkers.walks import made_markers
from tests.service.inside import answers

LIFT = {"points": [[[0.0, 0.0]] * 15] * 30, "fps": 30.0, "unit": "m"}
FIT = {"kind": "tree", "name": "mine"}
HISTORY = np.zeros((12, 25)).tolist()


def bounds(kind: type, name: str) -> tuple[float, float]:
    field = kind.model_json_schema()["properties"][name]
    (number,) = [part for part in field.get("anyOf", [field]) if "minimum" in part]
    return number["minimum"], number["maximum"]


@pytest.mark.parametrize(
    ("kind", "base", "wrong"),
    [
        (SynthesisRequest, {}, {"speed": "1", "fps": math.nan, "seed": 1.5, "variation": math.inf, "pace": 1,
                                "model": "../x", "deviations": [0.0] * 65}),
        (GaitRequest, {}, {"seconds": 1.9, "fps": 29}),
        (GaitRequest, {}, {"seconds": 601, "fps": 241}),
        (FitFields, FIT, {"name": "", "kind": "pca", "fps": 0.5, "unit": "parsec", "activity": "", "mirrored": "so",
                          "speed": "1"}),
        (FitFields, FIT, {"name": "A", "fps": "nan", "activity": "a\tb"}),
        (FitFields, FIT, {"name": "a/b", "fps": "many"}), (FitFields, FIT, {"name": "a" * 64}),
        (FitFields, FIT, {"name": "a\n"}), (FitFields, FIT, {"name": "-a"}),
        (LiftRequest, LIFT, {"points": [[[0.0, 0.0]] * 14] * 30, "fps": 0.5, "unit": "cm", "view": 361.0,
                             "elevation": 86.0, "scale": 0.0}),
        (LiftRequest, LIFT, {"points": LIFT["points"][:7], "fps": 1001.0, "elevation": "some"}),
        (SamplesRequest, {}, {"temperature": 0.0, "noise": -0.1, "n": 0, "method": "best", "history": HISTORY[:9]}),
        (TreeSynthesisRequest, {}, {"speed": -0.1, "seconds": 0.0}),
        (StreamSettings, {}, {"spede": 1.0, "heading": 3601.0, "temperature": 0.0}),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_by_its_field(kind, base, wrong):
    kind(**base)
    for field, value in wrong.items():
        with pytest.raises(ValidationError) as refused:
            kind(**base | {field: value})
        assert refused.value.errors()[0]["loc"][0] == field


@pytest.mark.parametrize(
    ("kind", "asked", "says"),
    [
        (SynthesisRequest, {"seconds": 0.01, "fps": 1.0}, "seconds · fps must be at least one frame"),
        (SynthesisRequest, {"deviations": [1.0], "scores": [1.0]}, "give either deviations or scores, not both"),
        (LiftRequest, LIFT | {"camera": {"K": [[1.0] * 3] * 3, "t": [0.0] * 3}}, "R and t belong together"),
        (SamplesRequest, {"history": HISTORY, "start": "walk"}, "give history or start, not both"),
    ],
)
def test_fields_that_do_not_go_together_are_refused_in_words(kind, asked, says):
    with pytest.raises(ValidationError, match=says):
        kind(**asked)


def test_names_of_models_are_no_paths():
    taken = TypeAdapter(ModelName).validate_python
    for name in (*names(), "fitted/my-walk", "fitted/" + "a" * 63):
        assert taken(name) == name
    for name in ("fpca", "walk/", "/x", "../x", "walk/..", "a/b/c", "Walk/fpca", "walk/fpca\n", "fitted/" + "a" * 64):
        with pytest.raises(ValidationError, match="pattern"):
            taken(name)
    for name in ("a", "my-walk", "0", "a" * 63):
        place = ModelRegistry(Path("models")).place(f"fitted/{FitFields(kind='fpca', name=name).name}", "")
        assert place == Path("models") / f"{name}.npz"


def test_every_seed_that_is_taken_is_one_of_the_library():
    taken = TypeAdapter(Seed).validate_python
    for seed in (0, 2**63 - 1):
        assert motionenv.synthesize("walk/fpca", 0.1, 30, seed=taken(seed)).poses.shape == (3, 25)
    for seed in (-1, 2**63):
        with pytest.raises(ValidationError, match="Input should be"):
            taken(seed)


def test_choices_are_what_there_is():
    def choices(model, field: str) -> set:
        options = get_args(model.model_fields[field].annotation)
        return {value for option in options for value in (get_args(option) or (option,))} - {type(None)}

    assert choices(ReadFields, "unit") == set(METRES)
    assert choices(ConvertFields, "format") == {JSON, *FILES}
    assert choices(RenderRequest, "format") == set(FILMS) - {PNG}
    assert set(get_args(Kind)) == set(KINDS)
    assert {f"walk/{kind}" for kind in choices(FitFields, "kind") - {"tree"}} <= set(MODELS)
    assert {*WAITING, "done"} < set(get_args(Status))
    assert set(JobStatus.model_fields) - set(Job.__dataclass_fields__) == {"files"}
    assert StimuliRequest().model_dump() == StimulusSet().model_dump()
    words = LiftRequest.model_fields["points"].description.replace(",", "").replace(":", "").split()
    pairs = [f"{side}_{word}" for word in words if f"left_{word}" in MARKERS for side in ("left", "right")]
    assert [word for word in words if word in MARKERS] + pairs == list(MARKERS)


def test_fields_of_a_form_are_text_and_become_numbers():
    asked = FitFields.model_validate(FIT | {"fps": "120", "mirrored": "true"})
    assert (asked.fps, asked.mirrored, asked.unit) == (120.0, True, None)


def inside(name: str) -> st.SearchStrategy:
    low, high = bounds(SynthesisRequest, name)
    return st.floats(low, high) | st.sampled_from([low, high])


@given(st.fixed_dictionaries({name: inside(name) for name in ("speed", "height", "phase", "variation", "fps")}),
       st.lists(st.floats(-5, 5), max_size=8), st.floats(0.02, 0.5), st.integers(0, 2**63 - 1))  # fmt: skip
def test_every_walk_that_is_taken_is_made(how, deviations, seconds, seed):
    seconds = max(seconds, 1 / how["fps"])
    asked = SynthesisRequest(**how, deviations=deviations, seconds=seconds, seed=seed)
    motion = asked.make(asked.model, seed)
    assert len(motion.poses) == asked.frames
    assert np.isfinite(motion.poses).all()
    assert motion.skeleton.height == asked.height


@pytest.mark.parametrize("name", ["speed", "height", "variation"])
def test_bounds_are_those_of_the_library(name):
    low, high = bounds(SynthesisRequest, name)
    for value in (float(np.nextafter(low, -np.inf)), float(np.nextafter(high, np.inf))):
        for kind in (SynthesisRequest, StreamSettings):
            with pytest.raises(ValidationError):
                kind(**{name: value})
        with pytest.raises(MotionError, match=f"{name} must be a number .* to {high:g}, got"):
            motionenv.synthesize("walk/fpca", 0.1, 30, **{name: value})


@pytest.mark.parametrize("at", [0, 1])
def test_settings_at_their_bounds_make_motion_and_pictures(at):
    for name in ("seed", "fps", "speed", "height", "variation"):
        stream = Stream(motionenv.load, StreamSettings(**{name: bounds(StreamSettings, name)[at]}))
        assert np.isfinite([stream.next() for _ in range(5)]).all()
    extreme = {name: float(bounds(Picture, name)[at]) for name in ("view", "elevation")}
    shown = Picture(width=16, height=16, colour=[at] * 3, background=[1 - at] * 3, **extreme)
    drawn = list(motionenv.film(motionenv.synthesize("walk/fpca", 0.1, 30, seed=0), **arguments(shown)))
    assert [picture.shape for picture in drawn] == [(16, 16, 3)] * 3
    assert arguments(shown)["alpha"] == pytest.approx(math.radians(extreme["view"]))


@pytest.fixture(scope="module")
def tree() -> MotionTree:
    """A tree of three short walks."""
    walks = [motionenv.synthesize("walk/fpca", 4, 30, seed=i, height=1.75) for i in range(3)]
    return MotionTree().fit_database(build_database([Clip(w, f"w{i}", "walk", str(i)) for i, w in enumerate(walks)]))


@pytest.mark.parametrize("extreme", [{"temperature": 1e-3}, {"temperature": 100.0}, {"noise": 100.0}, {"carry": True}])
def test_samples_at_the_bounds_are_drawn_and_those_beyond_are_refused_by_the_tree(tree, extreme):
    poses = motionenv.synthesize("walk/fpca", 5, 30, seed=9).poses
    for frames in (10, 120):
        asked = SamplesRequest(history=poses[:frames].tolist(), n=3, seed=1, **extreme)
        how = asked.model_dump(include={"temperature", "method", "carry", "noise", "seed"})
        assert tree.sample(np.array(asked.history), asked.n, **how).poses.shape == (3, 25)
    for field, value in (("temperature", 0.0), ("noise", -0.1), ("n", 0), ("method", "best")):
        with pytest.raises(MotionError, match=field):
            tree.sample(poses[:12], **{"n": 1, "seed": 0, field: value})
    with pytest.raises(MotionError, match="10"):
        tree.sample(poses[:9], 1, seed=0)


@pytest.mark.parametrize("extreme", [{"heading": -3600.0, "speed": 0.0}, {"heading": 3600.0, "speed": 10.0}])
def test_motion_at_the_bounds_grows(tree, extreme):
    asked = TreeSynthesisRequest(seconds=1 / 30, seed=2, activity="walk", **extreme)
    target = Target(asked.activity, np.radians(asked.heading), asked.speed)
    grown = tree.generator(None, seed=asked.seed, method=asked.method, target=target).motion(asked.seconds)
    assert (grown.poses.shape, grown.fps) == ((asked.frames, 25), asked.fps)
    for seconds in (0.51, 1.0, 3600.0):
        assert TreeSynthesisRequest(seconds=seconds).frames == round(30 * seconds)


def test_responses_are_as_their_schemas_say(tmp_path):
    walk = motionenv.synthesize("walk/fpca", 6, 100, seed=1)
    told = json.loads(to_json(Session((analyse(walk),), {}, shipped_band())))
    assert json.loads(GaitReport.model_validate(told, strict=False).model_dump_json()) == told
    points = project_markers(made_markers(motionenv.load("walk/eigenwalkers"), 3.0, 30, seed=5), np.radians(40.0))
    found = to_response(motionenv.lift(points))
    fitted = LiftResponse(**{name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in found.items()})
    assert set(found) | {"gait"} == set(LiftResponse.model_fields)
    assert (tuple(fitted.markers), tuple(fitted.pose)) == (MARKERS, POSE)
    assert np.shape(fitted.positions) == np.shape(fitted.band) == (90, 15, 3)
    paths = {"/v1/models": ModelList, "/v1/models/walk/fpca": ModelDescription,
             "/v1/models/walk/eigenwalkers": ModelDescription}  # fmt: skip
    for kind, answer in zip(paths.values(), answers(tmp_path, [("GET", path, {}) for path in paths]), strict=True):
        assert kind.model_validate(answer.json()).model_dump(mode="json") == answer.json()
    with pytest.raises(ValueError, match="less than or equal to 1"):
        Component(name="component 1", deviation=1.0, mean=0.0, share=1.1)
