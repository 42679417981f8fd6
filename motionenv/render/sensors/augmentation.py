"""Image augmentation: backgrounds, distractors, occluders, changing light, sensor noise.

All random choices of an episode are made when it begins, from that episode's own generator; each image then depends on
the frame number only. Images therefore don't depend on which episodes are rendered together, nor on threads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.threads import Workers
from motionenv._core.validation import checked_fps, checked_number, checked_whole
from motionenv.errors import MotionError
from motionenv.render.sensors import _sensor_kernel as kernel
from motionenv.render.sensors._procedural_backgrounds import OBJECTS, PEOPLE, PHASES, photographs, sprites
from motionenv.render.sensors._sensor_kernel import DEPTH, FAR, PARALLAX, THING
from motionenv.render.sensors.photographs import Bank, own_photographs, photograph_files
from motionenv.types import Frame

__all__ = ["BACKGROUNDS", "FAR", "Augmentation", "Augmenter"]

#: Kinds of background beside folders of photographs: a uniform colour, or a procedural photograph.
BACKGROUNDS = ("plain", "clutter")

_EYE = 1.1  # [m] camera height for which objects are placed
_NOTHING = np.empty((0, 0, 0, 3), np.uint8)


@dataclass(frozen=True)
class Augmentation:
    """Settings of the augmentation.

    Attributes:
        background: "plain", a random colour with a slight vertical gradient; "clutter", one of a bank of procedural
            photographs; or a folder, one of the photographs below it.
        distractors: number of other people and objects that pass through, behind or in front of the body.
        occluders: number of posts, boxes and bushes in front of the body.
        noise: standard deviation of the sensor's Gaussian noise [grey levels of 0 to 255].
        brightness: relative amplitude of slow changes of the light, from 0 to below 1.
        people: whether there are people among the distractors.
        alone: seconds after which distractors come into a still camera's view, before twice that time; 0 for any time.
    """

    background: str = "plain"
    distractors: int = 0
    occluders: int = 0
    noise: float = 0.0
    brightness: float = 0.0
    people: bool = True
    alone: float = 0.0

    def __post_init__(self) -> None:
        if self.background not in BACKGROUNDS:
            photograph_files(self.background)
        for name in ("distractors", "occluders"):
            object.__setattr__(self, name, checked_whole(getattr(self, name), name, 0, 100))
        checked_number(self.noise, "noise", 0, 255, "grey levels")
        checked_number(self.brightness, "brightness", 0, below=1)
        checked_number(self.alone, "alone", 0, 3600, "seconds")


class Augmenter:
    """Applies the augmentation `choice` to the images of `n` episodes, on a number of `threads`.

    Images are `width` × `height` [pixels], 16 to 1024; `fps` is the frame rate [Hz], for the speed of moving objects.
    """

    def __init__(
        self, choice: Augmentation, n: int, width: int, height: int, *, fps: float = 30.0, threads: int | None = 1
    ) -> None:
        if not isinstance(choice, Augmentation):
            raise MotionError(f"choice must be an Augmentation, got {type(choice).__name__}")
        self.choice, self.n, self.fps = choice, checked_whole(n, "n", 1), checked_fps(fps)
        self.width = checked_whole(width, "width", 16, 1024, "pixels")
        self.height = checked_whole(height, "height", 16, 1024, "pixels")
        self._workers = Workers(threads, "scenery")
        self._which, self._offset, self._gain = np.zeros(n, np.int64), np.zeros(n), np.zeros(n)
        self._colours, self._rise = np.zeros((n, 3), np.uint8), np.zeros(n)
        self._things = np.ones((n, choice.distractors + choice.occluders, THING))
        self._waves, self._keys = np.zeros((n, 4)), np.zeros(n, np.uint64)
        self._find()

    def begin(
        self, slot: int, rng: np.random.Generator, *, distance: float = 4.5, behind: float | None = None,
        focal: float | None = None,
    ) -> None:  # fmt: skip
        """Draw the scenery of a new episode.

        Args:
            slot: index of the episode, 0 to n - 1.
            rng: random generator.
            distance: from the camera to the body [m]; distractors and occluders avoid it.
            behind: from the camera to the background [m], for parallax; None is twice `distance`.
            focal: focal length [pixels]; None is that of a vertical field of view of 40 degrees.

        Raises:
            MotionError: no such slot, or a distance or focal length that isn't above 0.
        """
        if not 0 <= slot < self.n:
            raise MotionError(f"slot must be from 0 to {self.n - 1}, got {slot!r}")
        focal = self.height / 2 / math.tan(math.radians(20)) if focal is None else focal
        behind = 2 * distance if behind is None else behind
        for name, value in (("distance", distance), ("behind", behind), ("focal", focal)):
            checked_number(value, name, above=0)
        self._keys[slot] = rng.integers(2**64, dtype=np.uint64)
        # Two waves of the light, of periods of 4 to 12 s and of 1.5 to 4 s.
        slow, fast = 2 * np.pi / self.fps / rng.uniform((4.0, 1.5), (12.0, 4.0))
        phases = rng.uniform(0, 2 * np.pi, 2)
        self._waves[slot] = slow, phases[0], fast, phases[1]
        self._draw_backdrop(slot, rng)
        for k in range(self.choice.distractors):
            self._things[slot, k] = self._draw_passer(rng, distance, focal)
        for k in range(self.choice.distractors, self._things.shape[1]):
            self._things[slot, k] = self._draw_occluder(rng, distance)
        self._things[slot, :, PARALLAX] = behind / self._things[slot, :, DEPTH]

    def compose(self, frame: Frame, time: ArrayLike, pan: ArrayLike, slots: ArrayLike) -> Frame:
        """Augment images of bodies on black, in place; return them.

        Objects occlude what is farther away: at an occluded body pixel, `limbs` is 0, and `depth` is the object's.
        Background depth becomes `FAR`.

        Sensor noise is read from a table of 2¹⁸ Gaussian values (in steps of 1/32 standard deviation, up to four), each
        row of each frame from its own random offset. Values within a row are independent; two rows of W pixels share a
        shifted run of values with a probability of 6·W / 2¹⁸ (0.15 % at 64).

        Args:
            frame: (m, height, width) from `MultiBodyRaycaster.render`; without rgb only depth and limbs are augmented.
            time: (m,) frame numbers, from 0.
            pan: (m,) [pixels] shift of the background to the left since the start; nearer objects move farther.
            slots: (m,) episode of each image.

        Raises:
            MotionError: images of another size, no such slot, or a non-finite number.
        """
        if frame.depth.shape[1:] != (self.height, self.width):
            raise MotionError(f"frame must hold images of {self.height} × {self.width}, got {frame.depth.shape[1:]}")
        m = len(frame.depth)
        slots, time, pan = np.array(slots, np.int64), np.array(time, np.float64), np.array(pan, np.float64)
        if not len(slots) == len(time) == len(pan) == m:
            raise MotionError(f"time, pan and slots must have one entry per image ({m}), got {len(time)}, {len(pan)}")
        if m and not (slots.min() >= 0 and slots.max() < self.n and np.isfinite(time + pan).all()):
            raise MotionError(f"slots must be from 0 to {self.n - 1}, and time and pan finite")
        self._workers.share(lambda start, stop: self._compose(start, stop, slots, time, pan, frame), m)
        return frame

    def _compose(self, start: int, stop: int, slots, time, pan, frame: Frame) -> None:
        rgb, limbs, depth = frame.rgb, frame.limbs, frame.depth[start:stop]
        if rgb is not None and self._bank is None:
            kernel.put_colours(start, stop, slots, self._colours, self._rise, limbs, rgb)
        elif rgb is not None:
            photographs = self._photographs, self._which, self._offset, self._gain
            kernel.put_photographs(start, stop, slots, pan, *photographs, limbs, rgb)
        if self._things.shape[1]:
            pictures = frame.depth, limbs, _NOTHING if rgb is None else rgb
            kernel.put_things(start, stop, slots, time, pan, self._sprites, self._things, pictures)
        if rgb is not None and (self.choice.noise > 0 or self.choice.brightness > 0):
            light = float(self.choice.brightness), self._waves, float(self.choice.noise), self._keys, _gaussian()
            kernel.develop(start, stop, slots, time, light, rgb)
        np.minimum(depth, np.float32(FAR), out=depth)

    def close(self) -> None:
        """Stop the threads; they restart when needed."""
        self._workers.close()

    def _find(self) -> None:
        """Load the photographs and sprites that all augmenters of this size share."""
        size = self.width, self.height
        kind = self.choice.background
        self._bank: Bank | None = None
        if kind != "plain":
            self._bank = photographs(*size) if kind == "clutter" else own_photographs(photograph_files(kind), *size)
        self._photographs = np.empty((0, 0, 0, 3), np.uint8) if self._bank is None else self._bank.pictures
        self._sprites = sprites(*size) if self._things.shape[1] else np.empty((0, 0, 0, 4), np.uint8)

    def _draw_backdrop(self, slot: int, rng: np.random.Generator) -> None:
        if self._bank is None:
            grey, tint = rng.integers(50, 205), rng.integers(-34, 35, 3)
            self._colours[slot], self._rise[slot] = grey + tint, rng.uniform(-30, 30)
        else:
            self._which[slot] = self._bank.get(int(rng.integers(len(self._photographs))))
            self._offset[slot] = rng.integers(self._photographs.shape[2] - self.width)
            self._gain[slot] = rng.integers(154, 257)

    def _draw_passer(self, rng: np.random.Generator, distance: float, focal: float) -> np.ndarray:
        """A distractor (a person or, with probability 1/4, an object): one row of the kernel's table."""
        behind, person = rng.random() < 0.7, rng.random() < 0.75 and self.choice.people
        z = distance * (rng.uniform(1.25, 1.9) if behind else rng.uniform(0.55, 0.8))
        metre = focal / z
        high = metre * (rng.uniform(1.5, 1.95) if person else rng.uniform(0.5, 1.3))
        wide = high / 2 if person else high * rng.uniform(0.6, 1.5)
        speed = rng.uniform(0.7, 1.6) * rng.choice((-1, 1))
        first = int(rng.integers(PEOPLE)) * PHASES if person else OBJECTS["carts"][int(rng.integers(8))]
        step, shown, alone = speed * metre / self.fps, self.width + wide, self.choice.alone * self.fps
        period = shown + max(rng.uniform(0, self.width), 2 * alone * abs(step))
        phase, share = rng.random(2)
        # Anywhere on its path, or so that it reaches the picture's edge after one to two times `alone` frames.
        x = (0 if step > 0 else shown) - (1 + share) * alone * step if alone else share * period
        return np.array([
            first, PHASES if person else 1, abs(speed) / 1.35 / self.fps, phase, x, step, period,
            self.height / 2 + metre * _EYE - high, wide, high, z, speed < 0, rng.uniform(0.7, 1.0), 1,
        ])  # fmt: skip

    def _draw_occluder(self, rng: np.random.Generator, distance: float) -> np.ndarray:
        """An occluder (post, box or bush): one row of the kernel's table."""
        kind = ("posts", "boxes", "bushes")[int(rng.integers(3))]
        low, high = {"posts": ((0.07, 1.1), (0.16, 1.1)), "boxes": ((0.25, 0.25), (0.5, 0.5)),
                     "bushes": ((0.25, 0.4), (0.45, 0.8))}[kind]  # fmt: skip
        wide, tall = rng.uniform(low, high) * (self.width, self.height)
        bottom = self.height * (1.05 if kind != "bushes" else rng.uniform(0.8, 1.1))
        x = wide + rng.uniform(0, self.width - wide)
        return np.array([
            OBJECTS[kind][int(rng.integers(8))], 1, 0, 0, x, 0, 2 * self.width + wide,
            bottom - tall, wide, tall, distance * rng.uniform(0.3, 0.5), rng.random() < 0.5, rng.uniform(0.6, 1.0), 1,
        ])  # fmt: skip

    def __getstate__(self):
        return {
            name: value for name, value in self.__dict__.items() if name not in ("_bank", "_photographs", "_sprites")
        }

    def __setstate__(self, state: dict[str, Any]):
        self.__dict__.update(state)
        self._find()
        if self._bank is not None:
            for which in self._which:
                self._bank.get(int(which))


@cache
def _gaussian() -> np.ndarray:
    """Table (int8) of Gaussian noise: g represents (g + 1/2) / `STEPS` standard deviations."""
    values = np.random.default_rng(20260101).standard_normal(2**18)
    return np.clip(np.floor(kernel.STEPS * (values - values.mean()) / values.std()), -128, 127).astype(np.int8)
