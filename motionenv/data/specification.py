"""Specifications of data sets: walkers, cameras, pictures and output.

A specification is a frozen record that TOML or JSON files hold. Its `hash` names the content; two specifications with
the same hash and seed give the same samples.
"""

import hashlib
import json
import tomllib
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from motionenv.data.record import Record, read_content
from motionenv.errors import MotionError
from motionenv.types import FPS_RANGE, HEIGHT_RANGE, PEOPLE, SPEED_RANGE

#: Fields that are pictures, and those that are numbers; see `motionenv.data.samples` for shapes and units.
PICTURES = ("rgb", "mask", "limbs", "people", "depth")
TRUTH = (
    "poses", "joints", "pixels", "visibility", "detected", "phase", "contact", "body", "camera", "others", "face",
)  # fmt: skip
#: Names of the specifications that come with the package.
PRESETS = ("keypoints", "silhouette-gait", "tracking", "lifting")

_SECONDS_MOST = 60.0  # of a clip


def _ordered(low: float, high: float) -> AfterValidator:
    """Checks (least, greatest): two numbers in order within `low` to `high`."""

    def check(pair: tuple[float, float]) -> tuple[float, float]:
        if not low <= pair[0] <= pair[1] <= high:
            raise ValueError(f"must be two numbers in order from {low:g} to {high:g}")
        return pair

    return AfterValidator(check)


class People(Record):
    """Who walks.

    Attributes:
        models: gait models, names or files, of which each walker's is one, all as often.
        speed: (least, greatest) walking speed [m/s]; None leaves it to the model.
        person: kind of people, one of `motionenv.types.PEOPLE`.
        height: (least, greatest) body height [m]; None is people's own.
        turning: share of the walkers whose path winds left and right.
        radius: least radius of a turn [m].
        clothes: whether colours of skin and clothes are random or fixed.
        passers_by: (least, greatest) number of other people in a sample. Who would walk into the walker is left out.
        views: samples, each from another camera and at another time, that show the same walker.
    """

    models: tuple[str, ...] = Field(("walk/fpca",), min_length=1)
    speed: Annotated[tuple[float, float], _ordered(*SPEED_RANGE[:2])] | None = None
    person: Literal[PEOPLE] = "adult"  # type: ignore[valid-type]
    height: Annotated[tuple[float, float], _ordered(*HEIGHT_RANGE[:2])] | None = None
    turning: float = Field(0.0, ge=0, le=1)
    radius: float = Field(2.0, ge=1.0, le=100)
    clothes: bool = True
    passers_by: Annotated[tuple[int, int], _ordered(0, 8)] = (0, 0)
    views: int = Field(1, ge=1, le=256)


class Cameras(Record):
    """Where cameras stand, and what they have in view.

    Attributes:
        angle: (least, greatest) view angle [degrees]: 0 from the walker's right side, 90 from the front.
        elevation: (least, greatest) angle by which the camera looks down [degrees].
        field_of_view: (least, greatest) vertical field of view [degrees].
        margin: (least, greatest) share of the picture beyond the walker, drawn for each side; below 0 cuts the walker.
        distance: (least, greatest) horizontal distance to the walker [m]; None is what the margins ask for.
        follow: share of the clips whose camera moves with the walker.
    """

    angle: Annotated[tuple[float, float], _ordered(-180, 180)] = (-180.0, 180.0)
    elevation: Annotated[tuple[float, float], _ordered(-80, 80)] = (0.0, 10.0)
    field_of_view: Annotated[tuple[float, float], _ordered(5, 120)] = (30.0, 60.0)
    margin: Annotated[tuple[float, float], _ordered(-0.45, 0.45)] = (0.05, 0.25)
    distance: Annotated[tuple[float, float], _ordered(1, 100)] | None = None
    follow: float = Field(0.0, ge=0, le=1)


class Pictures(Record):
    """How pictures look.

    Attributes:
        width, height: size [pixels].
        background: "black", "plain" colours, "clutter", procedural photographs, or a folder of your own photographs.
        light: "fixed", or "varied": from another direction for each group of walkers.
        flicker: relative amplitude of slow changes of the light.
        objects: pictures of things that pass through, in front or behind. People who do are `People.passers_by`.
        occluders: posts, boxes and bushes in front.
        noise: standard deviation of the sensor's noise [grey levels of 0 to 255].
    """

    width: int = Field(128, ge=16, le=1024)
    height: int = Field(128, ge=16, le=1024)
    background: str = "plain"
    light: Literal["fixed", "varied"] = "fixed"
    flicker: float = Field(0.0, ge=0, lt=1)
    objects: int = Field(0, ge=0, le=20)
    occluders: int = Field(0, ge=0, le=20)
    noise: float = Field(0.0, ge=0, le=100)

    @model_validator(mode="after")
    def _on_black(self) -> Self:
        if self.background == "black" and (self.objects or self.occluders or self.noise or self.flicker):
            raise ValueError('background "black" takes no objects, occluders, noise or flicker: use "plain"')
        return self


class Output(Record):
    """What is written.

    Attributes:
        fields: of `PICTURES` and `TRUTH`.
        picture: how `rgb` is encoded; masks, ids and depth are always lossless and exact.
        shard: frames in a shard. More make fewer, larger files; fewer lose less when a machine dies.
    """

    fields: tuple[Literal[PICTURES + TRUTH], ...] = ("rgb", "mask", "poses", "joints", "pixels", "visibility", "camera")  # type: ignore[valid-type]
    picture: Literal["png", "webp", "jpeg"] = "png"
    shard: int = Field(4096, ge=1, le=1_000_000)

    @model_validator(mode="after")
    def _different(self) -> Self:
        if not self.fields or len(set(self.fields)) < len(self.fields):
            raise ValueError("fields must be at least one name, and none twice")
        return self


class Specification(Record):
    """A data set: who walks, what is seen of them, and how much of it.

    Attributes:
        frames: frames of the whole set, rounded up to whole clips.
        clip: frames of a clip; 1 makes single pictures.
        fps: frame rate of clips [Hz].
        seed: from which everything random follows.
        first_group: number of the group of people with which the set begins; parts of a set have others each.
        people, cameras, pictures, output: see `People`, `Cameras`, `Pictures` and `Output`.

    Example:
        >>> spec = Specification.read("keypoints").replace(frames=1000, pictures={"width": 256, "height": 256})
    """

    frames: int = Field(10_000, ge=1, le=10**12)
    clip: int = Field(1, ge=1, le=100_000)
    fps: float = Field(30.0, ge=FPS_RANGE[0], le=FPS_RANGE[1])
    seed: int = Field(0, ge=0, lt=2**63)
    first_group: int = Field(0, ge=0, lt=2**31)
    people: People = People()
    cameras: Cameras = Cameras()
    pictures: Pictures = Pictures()
    output: Output = Output()

    @model_validator(mode="after")
    def _short(self) -> Self:
        if self.clip / self.fps > _SECONDS_MOST:
            raise ValueError(f"clip must last {_SECONDS_MOST:g} s at most, got {self.clip} frames at {self.fps:g} fps")
        return self

    @classmethod
    def read(cls, source: str | Path) -> Self:
        """Read a TOML or JSON file, also a data set's `dataset.json`, or one of `PRESETS` by its name.

        Args:
            source: path of the file, or the name.

        Raises:
            MotionError: no such file or preset, not TOML or JSON, or as in `of`.
        """
        if str(source) in PRESETS:
            return cls.of(tomllib.loads(preset(str(source))))
        content = read_content(source, f"a specification is a .toml or .json file, or one of {', '.join(PRESETS)}")
        return cls.of(content.get("specification", content))  # the former is in a set's dataset.json

    def replace(self, **changes) -> Self:
        """The same with some `changes`: numbers, or for a section a dict of the fields that change in it.

        Raises:
            MotionError: as in `of`.
        """
        content = self.model_dump()
        for name, value in changes.items():
            whole = isinstance(value, dict) and isinstance(content.get(name), dict)
            content[name] = content[name] | value if whole else value
        return self.of(content)

    def json(self) -> str:  # type: ignore[override]
        """As a JSON text, which `read` and `of` take."""
        return json.dumps(self.model_dump(mode="json"), indent=1)

    @classmethod
    def schema(cls) -> dict[str, Any]:  # type: ignore[override]
        """The JSON Schema of specifications."""
        return cls.model_json_schema()

    @cached_property
    def hash(self) -> str:
        """SHA-256 (64 hexadecimal digits) of all that a sample's content depends on beside seed and index."""
        content = self.model_dump(mode="json", exclude={"frames", "seed"})
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    @property
    def samples(self) -> int:
        """Number of samples: clips, or single pictures."""
        return -(-self.frames // self.clip)

    @property
    def shard_samples(self) -> int:
        """Samples in a shard."""
        return max(1, self.output.shard // self.clip)

    @property
    def shards(self) -> int:
        """Number of shards."""
        return -(-self.samples // self.shard_samples)

    def range_of(self, shard: int) -> range:
        """Indices of the samples of a `shard`; the last one may be shorter.

        Raises:
            MotionError: no such shard.
        """
        if not 0 <= shard < self.shards:
            raise MotionError(f"shard must be from 0 to {self.shards - 1}, got {shard!r}")
        start = shard * self.shard_samples
        return range(start, min(start + self.shard_samples, self.samples))


def preset(name: str) -> str:
    """The TOML text of the preset `name`, one of `PRESETS`; otherwise raises MotionError."""
    if name not in PRESETS:
        raise MotionError(f"there is no preset {name!r}: {', '.join(PRESETS)}")
    return files(__package__).joinpath(f"presets/{name}.toml").read_text("utf-8")
