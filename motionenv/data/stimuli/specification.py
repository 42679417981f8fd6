"""Specifications of stimulus sets: walkers, displays and pictures."""

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, model_validator

from motionenv.data.record import Record, read_content
from motionenv.errors import MotionError
from motionenv.types import HEIGHT_RANGE, MARKERS, SPEED_RANGE

_STIMULI = 400  # most in a set
_FRAMES = 7200  # most of a stimulus


class PointLightWalker(Record):
    """Who walks.

    Attributes:
        model: a model that walks in place in closed form: `walk/fpca`, `walk/eigenwalkers`, or a file of such a model.
        deviations: standard deviations from the average along each component; missing ones are 0.
        speed: walking speed [m/s]; None takes the walker's own.
        height: body height [m]; None takes the model's.
    """

    model: str = "walk/fpca"
    deviations: tuple[float, ...] = Field((), max_length=64)
    speed: float | None = Field(None, ge=SPEED_RANGE[0], le=SPEED_RANGE[1])
    height: float | None = Field(None, ge=HEIGHT_RANGE[0], le=HEIGHT_RANGE[1])


class Display(Record):
    """How a walker is displayed as dots. Lengths in percent are of the body height.

    Attributes:
        view: view angle at the start [degrees]: 0 from the side, 90 from the front.
        turntable: how fast the view turns [degrees/s].
        roll: by how much the picture is turned in its plane [degrees], counter-clockwise.
        rate: playback rate; -1 plays backwards, 0 stands still.
        phase: of the first frame [cycles]; at 0 the left leg is furthest ahead.
        across: width [m] that the walker crosses again and again from its left end; 0 walks in place.
        inverted: upside down, as in a mirror below the feet.
        scrambled: each dot's path starts from a random place in the walker's box.
        desynchronised: each dot is at a random phase of its path.
        dots: dots of the walker that are visible at a time; which ones is random.
        lifetime: how long a dot is visible [s] until another one appears elsewhere on the body; None for ever.
        mask: dots of a mask, which moves as scrambled walkers do and lives as the walker's dots do.
        mask_size: side of the box around the walker [body heights] that the mask fills.
        lines: whether lines connect the visible dots of the walker to a stick figure.
        dot_size: diameter of dots [percent].
        line_width: of lines [percent].
        background: grey level, 0 is black and 1 is white.
        contrast: how far dots are from the background on the way to white, or, if negative, to black. Grey levels are
            not linear in luminance: calibrate your screen.
        seed: from which everything random follows.
    """

    view: float = Field(0.0, ge=-360, le=360)
    turntable: float = Field(0.0, ge=-720, le=720)
    roll: float = Field(0.0, ge=-360, le=360)
    rate: float = Field(1.0, ge=-10, le=10)
    phase: float = Field(0.0, ge=-1000, le=1000)
    across: float = Field(0.0, ge=0, le=100)
    inverted: bool = False
    scrambled: bool = False
    desynchronised: bool = False
    dots: int = Field(len(MARKERS), ge=1, le=len(MARKERS))
    lifetime: float | None = Field(None, ge=0.01, le=60)
    mask: int = Field(0, ge=0, le=1000)
    mask_size: float = Field(1.4, gt=0, le=10)
    lines: bool = False
    dot_size: float = Field(3.4, gt=0, le=50)
    line_width: float = Field(0.56, gt=0, le=50)
    background: float = Field(0.0, ge=0, le=1)
    contrast: float = Field(1.0, ge=-1, le=1)
    seed: int = Field(0, ge=0, lt=2**32)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.lifetime is not None and self.dots == len(MARKERS):
            told = f"lifetime needs fewer dots than {len(MARKERS)}: none is free to appear"
            raise MotionError(told, "lifetime", "dots")
        if not self.contrast or (self.background == 1 and self.contrast > 0) or (self.background == 0 > self.contrast):
            raise MotionError("contrast must make dots differ from the background", "contrast", "background")
        return self

    @property
    def grey(self) -> float:
        """Grey level of the dots, from 0 to 1."""
        end = 1.0 if self.contrast > 0 else 0.0
        return self.background + abs(self.contrast) * (end - self.background)


class StimulusSet(Record):
    """Stimuli: each person in each display.

    Attributes:
        people: who walks.
        displays: how that is displayed.
        seconds: of each stimulus [s].
        fps: frames per second.
        width, height: of the pictures [pixels].
        size: how much of the picture's height the body takes, in parallel projection.
        format: "mp4", one film each, or "png", a folder of lossless frames each.
    """

    noun = "stimulus set"

    people: tuple[PointLightWalker, ...] = Field((PointLightWalker(),), min_length=1)
    displays: tuple[Display, ...] = Field((Display(),), min_length=1)
    seconds: float = Field(2.0, gt=0, le=60)
    fps: float = Field(60.0, ge=1, le=240)
    width: int = Field(480, ge=16, le=4096)
    height: int = Field(480, ge=16, le=4096)
    size: float = Field(0.7, gt=0, le=5)
    format: Literal["mp4", "png"] = "mp4"

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if not 1 <= self.frames <= _FRAMES:
            raise MotionError(f"seconds · fps must be from 1 to {_FRAMES} frames, got {self.frames}", "seconds", "fps")
        if self.stimuli > _STIMULI:
            told = f"a set has {_STIMULI} stimuli at most, got {self.stimuli}: people times displays"
            raise MotionError(told, "people", "displays")
        return self

    @property
    def frames(self) -> int:
        """Frames of each stimulus."""
        return round(self.seconds * self.fps)

    @property
    def stimuli(self) -> int:
        """Number of stimuli."""
        return len(self.people) * len(self.displays)

    @classmethod
    def read(cls, source: Path) -> Self:
        """Read a TOML or JSON file at `source`, also the `stimuli.json` of a set that was made.

        Raises:
            MotionError: no such file, not TOML or JSON, or a field that is unknown or out of range.
        """
        content = read_content(source, "a stimulus set is a .toml or .json file")
        return cls.of(content.get("set", content))
