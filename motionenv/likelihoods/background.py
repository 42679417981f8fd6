"""Background subtraction in colour images: foreground probability per pixel, and background estimation.

A background pixel keeps its colour, up to a gain that the whole image shares (brightness) and Gaussian noise; a
foreground pixel has a uniformly distributed colour. Gain and noise are estimated from the image by medians, which are
correct as long as most of it is background. If the background estimate is poor, the estimated noise is large and the
probabilities become uninformative instead of wrong.

A tracker knows which pixels are background: those that the body doesn't cover. A `Background` with this feedback learns
only from them, so neither a standing person nor one approaching the camera becomes part of it. Pixels that the body has
covered since the beginning remain unknown, with probability one half, as long as they change: those that don't, while
a body is believed there, show a post or a bush that the tracker took for the person, and are background too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_whole
from motionenv.errors import MotionError

DARK = 24  # grey levels; darker pixels don't determine the gain
LEAST_NOISE = 1.0  # grey levels: rounding and other unavoidable variation
_PLAIN = 3.0  # grey levels: largest median absolute deviation of a uniform row
_COLOURFUL = 10.0  # grey levels: median deviation from a row's median, of pictures whose rows tell no background
_FILLED = 0.07  # share of a picture before plain rows: one walker covers less, things that hide people cover more
_EMPTY = 999  # missing sample; sorts after all colours
_UNCHANGED = 25  # frames after which a pixel that nobody uncovered is background; a walker's change much sooner
_CHANGED = 4.0  # least change of a pixel from frame to frame, in standard deviations of the image's noise
TO_DEVIATION = 1.4826  # median absolute deviation → standard deviation of a Gaussian


def foreground_probability(rgb: np.ndarray, background: ArrayLike) -> np.ndarray:
    """Probability (height, width) that a pixel is foreground, with equal prior probabilities.

    Args:
        rgb: uint8 (height, width, 3), the image.
        background: (height, width, 3), the same view without the person, 0 to 255; NaN where unknown, which gives one
            half.

    Raises:
        MotionError: incompatible shapes.
    """
    rgb = picture(rgb)
    background = np.asarray(background, dtype=np.float64)
    if background.shape != rgb.shape or np.isinf(background).any():
        raise MotionError(f"background must be finite and have rgb's shape {rgb.shape}, got {background.shape}")
    known = np.isfinite(background).all(axis=-1)
    if not known.any():
        return np.full(known.shape, 0.5)
    bright = background > DARK  # False where NaN
    gain = float(np.median(rgb[bright] / background[bright])) if bright.any() else 1.0
    difference = rgb - gain * background
    typical = float(np.median(np.abs(difference[known])))
    sigma = max(TO_DEVIATION * typical, LEAST_NOISE)
    log_odds = 0.5 * (difference**2).sum(-1) / sigma**2 - 3 * np.log(256 / (sigma * np.sqrt(2 * np.pi)))
    return 1.0 / (1.0 + np.exp(-np.where(known, np.clip(log_odds, -50.0, 50.0), 0.0)))


class Background:
    """Running background estimate from pictures in which one knows where the body is.

    It is the median, per pixel, of the last `frames` images in which the body didn't cover the pixel, according to
    `learn`. Before the first call of that, and for a panning camera, it is each row's median colour: right for plain
    walls and skies, else poor, as large residuals reveal. Of still clutter, `PixelHistory` knows more.

    Args:
        frames: number of images kept per pixel.
    """

    def __init__(self, frames: int = 31) -> None:
        self.frames = checked_whole(frames, "frames", 1)
        self._last: np.ndarray | None = None
        self._count: np.ndarray | None = None  # (height, width) samples ever stored

    def observe(self, rgb: np.ndarray) -> None:
        """Add an image, uint8 `rgb` (height, width, 3).

        Raises:
            MotionError: another type, or another size than before.
        """
        rgb = picture(rgb)
        if self._last is None:
            self._since = np.zeros(rgb.shape[:2], dtype=np.int64)  # frames without a change
        elif self._last.shape != rgb.shape:
            raise MotionError(f"rgb must have the shape of earlier images {self._last.shape}, got {rgb.shape}")
        else:
            apart = np.abs(rgb.astype(np.int16) - self._last).max(axis=-1)
            noise = max(TO_DEVIATION * float(np.median(apart)), LEAST_NOISE)
            self._since = np.where(apart > _CHANGED * noise, 0, self._since + 1)
        self._last = rgb.copy()

    def learn(self, body: ArrayLike) -> None:
        """Learn the uncovered pixels of the last image.

        Args:
            body: bool (height, width), where the body is or may be.

        Raises:
            MotionError: no image yet, or one of another size.
        """
        body = np.asarray(body, dtype=bool)
        if self._last is None or body.shape != self._last.shape[:2]:
            raise MotionError(f"body must have the size of the last image, got {body.shape}: call observe(rgb) first")
        if self._count is None:
            self._samples = np.full((*self._last.shape, self.frames), _EMPTY, dtype=np.int16)
            self._count = np.zeros(body.shape, dtype=np.int64)
        rows, columns = np.nonzero(~body | ((self._count == 0) & (self._since >= _UNCHANGED)))
        self._samples[rows, columns, :, self._count[rows, columns] % self.frames] = self._last[rows, columns]
        self._count[rows, columns] += 1

    def estimate(self) -> np.ndarray:
        """The background (height, width, 3), 0 to 255; NaN where unknown, after `learn` where it was never uncovered.

        Rows whose known part is uniform are assumed to be uniform behind the body too.

        Raises:
            MotionError: no image yet.
        """
        if self._last is None:
            raise MotionError("no image has been observed yet: call observe(rgb) first")
        if self._count is None:
            return row_medians(self._last).copy()
        middle = np.minimum(self._count, self.frames)[..., None, None] // 2
        median = np.take_along_axis(np.sort(self._samples, axis=-1), middle, axis=-1)[..., 0]
        return _plain_filled(np.where(self._count[..., None] > 0, median, np.nan))


def row_medians(rgb: np.ndarray) -> np.ndarray:
    """The median colour of each row, in the shape of `rgb` (height, width, 3)."""
    return np.broadcast_to(np.median(rgb, axis=1, keepdims=True), rgb.shape)


def cluttered(rgb: np.ndarray) -> bool:
    """Whether a picture, uint8 `rgb`, has rows too colourful, or too much before them, to tell its background."""
    rows = row_medians(rgb)
    colourful = np.median(np.abs(rgb - rows)) > _COLOURFUL
    return bool(colourful or np.mean(foreground_probability(rgb, rows) > 0.9) > _FILLED)


def _plain_filled(background: np.ndarray) -> np.ndarray:
    """Fill NaNs of a background (height, width, 3) with the row's median colour, in almost uniform rows."""
    rows = np.flatnonzero(np.isnan(background[..., 0]).any(axis=1) & ~np.isnan(background[..., 0]).all(axis=1))
    middle = np.nanmedian(background[rows], axis=1, keepdims=True)
    apart = np.nanmedian(np.abs(background[rows] - middle), axis=(1, 2))
    plain = apart <= _PLAIN
    filled = background[rows[plain]]
    background[rows[plain]] = np.where(np.isnan(filled), middle[plain], filled)
    return background


def picture(rgb: ArrayLike) -> np.ndarray:
    """`rgb` as an array.

    Raises:
        MotionError: not uint8 (height, width, 3).
    """
    rgb = np.asarray(rgb)
    if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[-1] != 3 or not rgb.size:
        raise MotionError(f"rgb must be uint8 (height, width, 3), got {rgb.dtype} {rgb.shape}")
    return rgb
