"""Scene description for both engines: light, clothes, ground and sky."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number
from motionenv.body.limbs import CLOTHES, COLOURS
from motionenv.errors import MotionError

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Scene:
    """Light, clothes, ground and sky. Colours are sRGB from 0 to 1, light is linear.

    Attributes:
        key, fill: unit vectors from the world's origin towards the two directional lights.
        key_light, fill_light: their radiance (red, green, blue).
        ambient: ambient light, relative to a surface's colour.
        skin, shirt, trousers, shoes, hair: colours of the body.
        tiles: the two colours of the checkered ground.
        tile: side of a tile [m].
        horizon, zenith: colours of the sky; the ground fades into `horizon`.
        fade: distance at which the ground is half faded [m].
        ground: whether there is a ground; without one the sky extends to the nadir.
        shadows: whether the body casts the key light's shadow on the ground.
        samples: rays per pixel and axis for RGB (1 to 4); depth and ids always come from pixel centres.
    """

    key: tuple[float, float, float] = (0.35, -0.45, 0.82)
    fill: tuple[float, float, float] = (-0.5, 0.6, 0.45)
    key_light: Colour = (2.35, 2.2, 2.0)
    fill_light: Colour = (0.55, 0.65, 0.8)
    ambient: Colour = (0.26, 0.27, 0.3)
    skin: Colour = COLOURS["skin"]
    shirt: Colour = COLOURS["shirt"]
    trousers: Colour = COLOURS["trousers"]
    shoes: Colour = COLOURS["shoes"]
    hair: Colour = COLOURS["hair"]
    tiles: tuple[Colour, Colour] = ((0.77, 0.77, 0.76), (0.67, 0.67, 0.67))
    tile: float = 0.5
    horizon: Colour = (0.93, 0.95, 0.97)
    zenith: Colour = (0.62, 0.75, 0.89)
    fade: float = 14.0
    ground: bool = True
    shadows: bool = True
    samples: int = 1

    def __post_init__(self) -> None:
        for name in ("key", "fill"):
            v = np.asarray(getattr(self, name), dtype=np.float64)
            if v.shape != (3,) or not np.isfinite(v).all() or not v[2] > 0.05 * np.linalg.norm(v):
                raise MotionError(f"Scene.{name} must be a direction with z > 0, got {getattr(self, name)!r}")
            object.__setattr__(self, name, tuple(float(x) for x in v / np.linalg.norm(v)))
        if self.samples not in (1, 2, 3, 4):
            raise MotionError(f"Scene.samples must be 1, 2, 3 or 4, got {self.samples!r}")
        for name in ("tile", "fade"):
            checked_number(getattr(self, name), f"Scene.{name}", above=0, unit="metres")

    @property
    def limb_colours(self) -> np.ndarray:
        """Linear colour of every drawn limb, (limbs, 3), in the order of `motionenv.body.LIMBS`."""
        return linear([getattr(self, worn) for worn in CLOTHES])

    @property
    def lights(self) -> np.ndarray:
        """Direction towards each light and its radiance, (2, 6): the key light first."""
        return np.array([(*self.key, *self.key_light), (*self.fill, *self.fill_light)])


def linear(colour: ArrayLike) -> np.ndarray:
    """Linear light from sRGB colours, with gamma 2.2 as in pyrender's shader."""
    return np.asarray(colour, dtype=np.float64) ** 2.2
