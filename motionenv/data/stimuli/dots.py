"""Positions of the dots of a point-light display at any time.

Everything random is a pure function of the display's seed and of what is drawn: numbers come from NumPy's counter-based
Philox4x64 (Salmon et al. 2011), with the seed and a stream as its key.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv.data.stimuli.specification import Display
from motionenv.render.cameras import orthographic
from motionenv.types import MARKERS, frozen

_PLACES, _PHASES, _ORDER, _MASK = 1, 2, 3, 4  # streams of random numbers
_BOX = (0.5, 0.5, 0.88)  # [body heights] in which dots are scrambled
_BELOW = 0.06  # [body heights] of the box
_MEANS = 4  # samples of a cycle from one that counts to the next, for the mean place of a dot


@dataclass(frozen=True, eq=False)
class Ring:
    """One cycle of a walk in place, over and over.

    Attributes:
        markers: (samples, 15, 3) [m], standing on z = 0 around the origin, at phases j / samples.
        stride: how far a cycle goes [m].
        seconds: how long it takes [s].
        height: of the body [m].
    """

    markers: np.ndarray
    stride: float
    seconds: float
    height: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "markers", frozen(self.markers, (None, len(MARKERS), 3), "Ring.markers"))

    def at(self, phases: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Markers `which` (n,) at `phases` (T, n) [cycles]: (T, n, 3) [m], by Catmull-Rom splines."""
        count = len(self.markers)
        place = (phases - np.floor(phases)) * count
        first = np.floor(place).astype(int)
        u = place - first
        weights = (
            u * (-0.5 + u * (1 - 0.5 * u)), 1 + u * u * (-2.5 + 1.5 * u),
            u * (0.5 + u * (2 - 1.5 * u)), u * u * (-0.5 + 0.5 * u),
        )  # fmt: skip
        return sum(w[..., None] * self.markers[(first + k - 1) % count, which] for k, w in enumerate(weights))


@dataclass(frozen=True, eq=False)
class Dots:
    """The dots of a stimulus: first the 15 of the walker, in the order of `MARKERS`, then those of the mask.

    Attributes:
        positions: (T, n, 3) [m], the walker's feet at z = 0.
        visible: (T, n) whether a dot is shown.
        plane: (T, n, 2) [body heights] to the right and up, from the middle of the body, as projected and rolled.
        depth: (T, n) [m] away from who looks.
    """

    positions: np.ndarray
    visible: np.ndarray
    plane: np.ndarray
    depth: np.ndarray


def dots_at(display: Display, walk: Ring, times: ArrayLike) -> Dots:
    """The dots of a `walk` in a `display`, at `times` (T,) [s] from the start."""
    times = frozen(times, (None,), "times")
    positions, visible = _walker(display, walk, times)
    if display.mask:
        masking, seen = _mask(display, walk, times)
        positions, visible = np.concatenate([positions, masking], axis=1), np.concatenate([visible, seen], axis=1)
    if display.inverted:
        positions[..., 2] = walk.height - positions[..., 2]
    if display.across:
        way = walk.stride / walk.seconds * display.rate * times
        positions[:, : len(MARKERS), 0] += (way % display.across - 0.5 * display.across)[:, None]
    return Dots(positions, visible, *_projected(display, walk.height, positions, times))


def _uniforms(display: Display, stream: int, *shape: int) -> np.ndarray:
    return np.random.Generator(np.random.Philox(key=[display.seed, stream])).random(shape)


def _phases(display: Display, walk: Ring, times: np.ndarray) -> np.ndarray:
    return display.phase + display.rate * times / walk.seconds


def _walker(display: Display, walk: Ring, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    n = len(MARKERS)
    offsets = _uniforms(display, _PHASES, n) if display.desynchronised else np.zeros(n)
    positions = walk.at(_phases(display, walk, times)[:, None] + offsets, np.arange(n))
    if display.scrambled:
        places = (_uniforms(display, _PLACES, n, 3) - [0.5, 0.5, 0.0]) * _BOX + [0, 0, _BELOW]
        positions += places * walk.height - walk.markers[::_MEANS].mean(axis=0)
    return positions, _visible(display, times)


def _visible(display: Display, times: np.ndarray) -> np.ndarray:
    """(T, 15): the last `dots` of an order in which no dot comes again while it is visible."""
    n, shown = len(MARKERS), display.dots
    changes = np.zeros(len(times), dtype=int)
    if display.lifetime is not None:
        changes = np.floor(np.maximum(times, 0) * shown / display.lifetime).astype(int)
    numbers = _uniforms(display, _ORDER, shown + int(changes.max(initial=0)))
    order: list[int] = []
    for number in numbers:
        recent = order[-shown:] if len(order) >= shown else order
        free = [i for i in range(n) if i not in recent]
        order.append(free[math.floor(number * len(free))])
    visible = np.zeros((len(times), n), dtype=bool)
    for row, first in zip(visible, changes, strict=True):
        row[order[first : first + shown]] = True
    return visible


def _mask(display: Display, walk: Ring, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Dots that move as the walker's do, each at a random phase around a random place, which changes with each life."""
    each = np.arange(display.mask)
    lives = np.zeros((len(times), display.mask), dtype=int)
    if display.lifetime is not None:
        lives = np.floor(times[:, None] / display.lifetime + each / display.mask).astype(int)
    numbers = _uniforms(display, _MASK, int(lives.max(initial=0)) + 1, display.mask, 4)[lives, each]
    which = each % len(MARKERS)
    moving = walk.at(_phases(display, walk, times)[:, None] + numbers[..., 0], which)
    middle = (numbers[..., 1:] - 0.5) * display.mask_size * walk.height + [0, 0, 0.5 * walk.height]
    return moving - walk.markers[::_MEANS].mean(axis=0)[which] + middle, np.ones(lives.shape, dtype=bool)


def _projected(
    display: Display, height: float, positions: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`plane` and `depth` of `Dots`."""
    alpha = np.radians(display.view + display.turntable * times)[:, None]
    flat = orthographic(positions, alpha) / height - [0, 0.5]
    roll = math.radians(display.roll)
    turn = np.array([[math.cos(roll), math.sin(roll)], [-math.sin(roll), math.cos(roll)]])
    return flat @ turn, np.cos(alpha) * positions[..., 1] - np.sin(alpha) * positions[..., 0]
