"""What a tracker's camera sees besides the body: backdrops, other people, things in the way, changing light, noise.

Everything of an episode is drawn when it begins, from that episode's own generator; then each picture follows from
the frame's number. So pictures don't depend on which episodes are drawn together, nor on threads.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from motionenv.errors import MotionError
from motionenv.render import _sensor_kernel as kernel
from motionenv.render._clutter import OBJECTS, PEOPLE, PHASES, photographs, sprites
from motionenv.render._sensor_kernel import DEPTH, FAR, PARALLAX, THING
from motionenv.render._workers import Workers
from motionenv.types import Frame

__all__ = ["BACKGROUNDS", "FAR", "Scenery", "SceneryChoice"]

#: What can be behind: an even colour, or a photograph of clutter.
BACKGROUNDS = ("plain", "clutter")

_EYE = 1.1  # height of the camera above the ground that things are placed for [m]
_NOTHING = np.empty((0, 0, 0, 3), np.uint8)


@dataclass(frozen=True)
class SceneryChoice:
    """What there is to see besides the body.

    Attributes:
        background: "plain", a random even colour that gets a little lighter or darker downwards; or "clutter", one of
            a bank of made-up photographs.
        distractors: how many other people and things pass through, behind the body or in front of it.
        occluders: how many posts, boxes and bushes stand in front of the body.
        noise: standard deviation of the sensor's Gaussian noise [grey levels of 0 to 255], from 0.
        brightness: share by which the light rises and falls over some seconds, from 0 to below 1.
    """

    background: str = "plain"
    distractors: int = 0
    occluders: int = 0
    noise: float = 0.0
    brightness: float = 0.0

    def __post_init__(self):
        if self.background not in BACKGROUNDS:
            raise MotionError(f"background must be one of {', '.join(BACKGROUNDS)}, got {self.background!r}")
        for name in ("distractors", "occluders"):
            count = getattr(self, name)
            if isinstance(count, bool) or not isinstance(count, int | np.integer) or not 0 <= count <= 100:
                raise MotionError(f"{name} must be a whole number from 0 to 100, got {count!r}")
        if not _is_number(self.noise) or not 0 <= self.noise <= 255:
            raise MotionError(f"noise must be a number of grey levels from 0 to 255, got {self.noise!r}")
        if not _is_number(self.brightness) or not 0 <= self.brightness < 1:
            raise MotionError(f"brightness must be a share from 0 to below 1, got {self.brightness!r}")


class Scenery:
    """The surroundings of n episodes.

    Args:
        choice: what there is.
        n: how many episodes.
        width: of the pictures [pixels], 16 to 512.
        height: of the pictures [pixels], 16 to 512.
        fps: frames per second, for the speed of what moves.
        threads: how many pictures are composed at a time.
    """

    def __init__(self, choice: SceneryChoice, n: int, width: int, height: int, *, fps: float = 30.0, threads: int = 1):
        if not isinstance(choice, SceneryChoice):
            raise MotionError(f"choice must be a SceneryChoice, got {type(choice).__name__}")
        for name, value, low, high in (("n", n, 1, None), ("width", width, 16, 512), ("height", height, 16, 512)):
            whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
            if not whole or value < low or (high is not None and value > high):
                limits = f"from {low}" + ("" if high is None else f" to {high} pixels")
                raise MotionError(f"{name} must be a whole number {limits}, got {value!r}")
        if not _is_number(fps) or not 0 < fps < math.inf:
            raise MotionError(f"fps must be a number of frames per second above 0, got {fps!r}")
        self.choice = choice
        self.n, self.width, self.height, self.fps = int(n), int(width), int(height), float(fps)
        self._workers = Workers(threads, "scenery")
        self._which, self._offset, self._gain = np.zeros(n, np.int64), np.zeros(n), np.zeros(n)
        self._colours, self._rise = np.zeros((n, 3), np.uint8), np.zeros(n)
        self._things = np.ones((n, choice.distractors + choice.occluders, THING))
        self._waves, self._keys = np.zeros((n, 4)), np.zeros(n, np.uint64)
        self._find()

    def begin(
        self,
        slot: int,
        rng: np.random.Generator,
        *,
        distance: float = 4.5,
        behind: float | None = None,
        focal: float | None = None,
    ) -> None:
        """Draw the surroundings of a new episode.

        Args:
            slot: whose they are, 0 to n - 1.
            rng: where all of them come from.
            distance: from the camera to the body [m]; passers-by and occluders keep clear of it.
            behind: from the camera to the backdrop [m], for what is nearer pans faster; twice `distance` when None.
            focal: of the camera [pixels]; that of 40 degrees from top to bottom when None.

        Raises:
            MotionError: there is no such slot, or a distance or the focal length isn't above 0.
        """
        if not 0 <= slot < self.n:
            raise MotionError(f"slot must lie from 0 to {self.n - 1}, got {slot!r}")
        focal = self.height / 2 / math.tan(math.radians(20)) if focal is None else focal
        behind = 2 * distance if behind is None else behind
        for name, value in (("distance", distance), ("behind", behind), ("focal", focal)):
            if not 0 < value < math.inf:
                raise MotionError(f"{name} must be finite and above 0, got {value!r}")
        self._keys[slot] = rng.integers(2**64, dtype=np.uint64)
        self._waves[slot] = self._draw_waves(rng)
        self._draw_backdrop(slot, rng)
        for k in range(self.choice.distractors):
            self._things[slot, k] = self._draw_passer(rng, distance, focal)
        for k in range(self.choice.distractors, self._things.shape[1]):
            self._things[slot, k] = self._draw_occluder(rng, distance)
        self._things[slot, :, PARALLAX] = behind / self._things[slot, :, DEPTH]

    def compose(self, frame: Frame, time, pan, slots) -> Frame:
        """Complete pictures of bodies on black, in place.

        Things hide what is farther away: of a body behind one, `limbs` is 0, and `depth` the thing's. Where nothing
        is nearer, depth becomes `FAR`.

        Sensor noise is read from a table of 2¹⁸ Gaussian values (in steps of 1/32 standard deviation, up to four),
        each row of each frame from a place of its own. So values of one row are independent; two rows of W pixels, of
        one frame or of different ones, share a run of values, shifted, with a probability of 6·W / 2¹⁸ (0.15 % at 64).

        Args:
            frame: (m, height, width) of `Crowd.render`; without rgb only depth and limbs are completed.
            time: (m,) numbers of the frames, from 0.
            pan: (m,) pixels by which the backdrop has moved left since the start; what is nearer moves farther.
            slots: (m,) the episodes that the pictures belong to.

        Returns:
            `frame`.

        Raises:
            MotionError: the pictures are of another size, there is no such slot, or a number isn't finite.
        """
        if frame.depth.shape[1:] != (self.height, self.width):
            raise MotionError(f"frame must hold pictures {self.height} × {self.width}, got {frame.depth.shape[1:]}")
        m = len(frame.depth)
        slots, time, pan = np.array(slots, np.int64), np.array(time, np.float64), np.array(pan, np.float64)
        if not len(slots) == len(time) == len(pan) == m:
            raise MotionError(f"time, pan and slots must have one entry per picture ({m}), got {len(time)}, {len(pan)}")
        if m and not (slots.min() >= 0 and slots.max() < self.n and np.isfinite(time + pan).all()):
            raise MotionError(f"slots must lie from 0 to {self.n - 1}, and time and pan be finite")
        backdrop = self._photographs, self._which, self._offset, self._gain, self._colours, self._rise
        things = self._sprites, self._things
        light = float(self.choice.brightness), self._waves, float(self.choice.noise), self._keys, _gaussian()
        pictures = frame.depth, frame.limbs, _NOTHING if frame.rgb is None else frame.rgb
        self._workers.share(
            lambda start, stop: kernel.compose(start, stop, slots, time, pan, backdrop, things, light, pictures), m
        )
        return frame

    def close(self) -> None:
        """End the threads; the next call starts new ones."""
        self._workers.close()

    def _find(self) -> None:
        """Find the pictures that all sceneries of this size share."""
        size = self.width, self.height
        self._bank = photographs(*size) if self.choice.background == "clutter" else None
        self._photographs = np.empty((0, 0, 0, 3), np.uint8) if self._bank is None else self._bank.pictures
        self._sprites = sprites(*size) if self._things.shape[1] else np.empty((0, 0, 0, 4), np.uint8)

    def _draw_waves(self, rng: np.random.Generator) -> np.ndarray:
        """Frequencies [rad/frame] and phases of the light: periods of 4 to 12 s, and of 1.5 to 4 s."""
        slow, fast = 2 * np.pi / self.fps / rng.uniform((4.0, 1.5), (12.0, 4.0))
        phases = rng.uniform(0, 2 * np.pi, 2)
        return np.array([slow, phases[0], fast, phases[1]])

    def _draw_backdrop(self, slot: int, rng: np.random.Generator) -> None:
        """Choose a photograph and its part, or an even colour."""
        if self._bank is None:
            grey, tint = rng.integers(50, 205), rng.integers(-34, 35, 3)
            self._colours[slot], self._rise[slot] = grey + tint, rng.uniform(-30, 30)
        else:
            self._which[slot] = self._bank.get(int(rng.integers(len(self._photographs))))
            self._offset[slot] = rng.integers(self._photographs.shape[2] - self.width)
            self._gain[slot] = rng.integers(154, 257)

    def _draw_passer(self, rng: np.random.Generator, distance: float, focal: float) -> np.ndarray:
        """A person or, one time in four, a thing that passes through: one row of the kernel's table."""
        behind, person = rng.random() < 0.7, rng.random() < 0.75
        z = distance * (rng.uniform(1.25, 1.9) if behind else rng.uniform(0.55, 0.8))
        metre = focal / z
        high = metre * (rng.uniform(1.5, 1.95) if person else rng.uniform(0.5, 1.3))
        wide = high / 2 if person else high * rng.uniform(0.6, 1.5)
        speed = rng.uniform(0.7, 1.6) * rng.choice((-1, 1))
        first = int(rng.integers(PEOPLE)) * PHASES if person else OBJECTS["carts"][int(rng.integers(8))]
        period = self.width + wide + rng.uniform(0, self.width)
        return np.array([
            first, PHASES if person else 1, abs(speed) / 1.35 / self.fps, rng.random(),
            rng.uniform(0, period), speed * metre / self.fps, period,
            self.height / 2 + metre * _EYE - high, wide, high, z, speed < 0, rng.uniform(0.7, 1.0), 1,
        ])  # fmt: skip

    def _draw_occluder(self, rng: np.random.Generator, distance: float) -> np.ndarray:
        """A post, a box or a bush that stands in front: one row of the kernel's table."""
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

    def __setstate__(self, state):
        self.__dict__.update(state)
        self._find()
        if self._bank is not None:
            for which in self._which:
                self._bank.get(int(which))


def _is_number(value) -> bool:
    """Whether it is a number that isn't a bool."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


@cache
def _gaussian() -> np.ndarray:
    """Table (int8) of Gaussian noise: g stands for (g + 1/2) / `STEPS` standard deviations, never quite zero."""
    values = np.random.default_rng(20260101).standard_normal(2**18)
    return np.clip(np.floor(kernel.STEPS * (values - values.mean()) / values.std()), -128, 127).astype(np.int8)
