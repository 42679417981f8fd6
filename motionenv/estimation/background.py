"""What in a colour picture isn't background: a probability per pixel, and the background itself where nobody gives it.

A pixel of the background keeps its colour, but for a gain that the whole picture shares (brightness) and Gaussian
noise; a pixel of anything else has any colour with the same probability. Both gain and noise are estimated from the
picture by medians, which hold as long as most of it is background. Where the background is a bad guess, the noise
comes out large and probabilities go towards what colours can't tell: the picture says less instead of something wrong.

Who follows the body knows what of each picture is background: all that the body doesn't cover. A `Background` that is
told learns nothing else, so that neither somebody who stands still nor somebody who comes straight at the camera
becomes part of it; what the body has covered ever since isn't known, and says nothing.
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.numeric import as_number, checked_whole

_DARK = 24  # grey levels; darker pixels say nothing of the gain
_LEAST_NOISE = 1.0  # grey levels: rounding, and what else is never quite the same
_PLAIN = 3.0  # grey levels by which pixels of a plain row differ from its median, half of them by more
_EMPTY = 999  # a sample that isn't there: sorts behind all colours
_TO_DEVIATION = 1.4826  # median absolute deviation → standard deviation of a Gaussian


def foreground_probability(rgb, background, *, noise: float | None = None) -> np.ndarray:
    """Probability (height, width) that a pixel isn't background, both being as likely beforehand.

    Args:
        rgb: uint8 (height, width, 3), the picture.
        background: (height, width, 3), the same view without anybody, 0 to 255; NaN where it isn't known, and where
            the probability is one half.
        noise: standard deviation of colours [grey levels]; None estimates it from the picture.

    Raises:
        MotionError: shapes that don't go together, or noise that isn't above 0.
    """
    rgb = picture(rgb)
    background = np.asarray(background, dtype=np.float64)
    if background.shape != rgb.shape or np.isinf(background).any():
        raise MotionError(f"background must be finite and of the picture's shape {rgb.shape}, got {background.shape}")
    known = np.isfinite(background).all(axis=-1)
    if not known.any():
        return np.full(known.shape, 0.5)
    if noise is not None and not 0 < as_number(noise) < np.inf:
        raise MotionError(f"noise must be a number of grey levels above 0, got {noise!r}")
    bright = background > _DARK  # False where NaN
    gain = float(np.median(rgb[bright] / background[bright])) if bright.any() else 1.0
    difference = rgb - gain * background
    typical = float(np.median(np.abs(difference[known])))
    sigma = max(_TO_DEVIATION * typical, _LEAST_NOISE) if noise is None else noise
    log_odds = 0.5 * (difference**2).sum(-1) / sigma**2 - 3 * np.log(256 / (sigma * np.sqrt(2 * np.pi)))
    return 1.0 / (1.0 + np.exp(-np.where(known, np.clip(log_odds, -50.0, 50.0), 0.0)))


class Background:
    """A running estimate of the background from the pictures of a camera that stands still.

    Per pixel it is the median of the last `frames` pictures in which no body covered it, as `learn` is told. As long as
    nobody tells, it is that of all pictures, from `least` of them on: right where a walker stood in fewer than half of
    them. Before, and with a camera that pans, each row's median colour stands in for it: right for plain walls
    and skies, and a bad guess, that says so by its residuals, for anything else.

    Args:
        frames: how many pictures to keep, of each pixel.
        least: how many are needed for the median of all pictures.
        still: False for a camera that pans.
    """

    def __init__(self, frames: int = 31, least: int = 8, *, still: bool = True):
        self.frames = checked_whole(frames, "frames", 1)
        self.least, self.still = checked_whole(least, "least", 1, self.frames), still
        self._last: np.ndarray | None = None
        self._told = False

    def observe(self, rgb) -> None:
        """Take in a picture, uint8 `rgb` (height, width, 3).

        Raises:
            MotionError: not such a picture, or of another size than those before.
        """
        rgb = picture(rgb)
        if self._last is None:
            self._empty(rgb.shape)
        elif self._last.shape != rgb.shape:
            raise MotionError(f"pictures so far are {self._last.shape}, this one is {rgb.shape}: start anew")
        self._last = rgb.copy()
        if not self._told:
            self._keep(np.ones(rgb.shape[:2], dtype=bool))

    def learn(self, body) -> None:
        """Of the last picture, learn what isn't covered; the first time, what was learned without being told goes.

        Args:
            body: bool (height, width), where the body is, or may be.

        Raises:
            MotionError: no picture yet, or one of another size.
        """
        body = np.asarray(body, dtype=bool)
        if self._last is None or body.shape != self._last.shape[:2]:
            raise MotionError(f"body must be of the last picture's size, got {body.shape}: call observe(rgb) first")
        if not self._told:
            self._empty(self._last.shape)
        self._told = True
        self._keep(~body)

    def estimate(self) -> np.ndarray:
        """The background (height, width, 3), 0 to 255; once told of bodies NaN where it has never been seen.

        Not so in rows that are plain as far as they have been seen: those are taken to be plain behind the body too.

        Raises:
            MotionError: no picture yet.
        """
        if self._last is None:
            raise MotionError("no picture has been observed yet: call observe(rgb) first")
        if self._told:
            return _plain_filled(np.where(self._count[..., None] > 0, self._median(), np.nan))
        if self.still and self._count.max() >= self.least:
            return self._median()
        return np.broadcast_to(np.median(self._last, axis=1, keepdims=True), self._last.shape)

    def _empty(self, shape: tuple[int, ...]) -> None:
        self._samples = np.full((*shape, self.frames), _EMPTY, dtype=np.int16)
        self._count = np.zeros(shape[:2], dtype=np.int64)  # of samples ever kept

    def _keep(self, which: np.ndarray) -> None:
        """Keep the last picture's pixels `which` (height, width) in place of their oldest ones."""
        assert self._last is not None
        rows, columns = np.nonzero(which)
        self._samples[rows, columns, :, self._count[rows, columns] % self.frames] = self._last[rows, columns]
        self._count[rows, columns] += 1

    def _median(self) -> np.ndarray:
        """Of the samples (height, width, 3)."""
        middle = np.minimum(self._count, self.frames) // 2
        if middle.min() == middle.max():
            return np.partition(self._samples, middle.flat[0], axis=-1)[..., middle.flat[0]]
        ordered = np.sort(self._samples, axis=-1)
        return np.take_along_axis(ordered, middle[..., None, None], axis=-1)[..., 0]


def _plain_filled(background: np.ndarray) -> np.ndarray:
    """A background (height, width, 3) whose NaNs take the row's median colour, in rows that hardly differ from it."""
    rows = np.flatnonzero(np.isnan(background[..., 0]).any(axis=1) & ~np.isnan(background[..., 0]).all(axis=1))
    middle = np.nanmedian(background[rows], axis=1, keepdims=True)
    apart = np.nanmedian(np.abs(background[rows] - middle), axis=(1, 2))
    plain = apart <= _PLAIN
    filled = background[rows[plain]]
    background[rows[plain]] = np.where(np.isnan(filled), middle[plain], filled)
    return background


def picture(rgb) -> np.ndarray:
    """`rgb` as an array.

    Raises:
        MotionError: not uint8 (height, width, 3).
    """
    rgb = np.asarray(rgb)
    if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[-1] != 3 or not rgb.size:
        raise MotionError(f"rgb must be uint8 (height, width, 3), got {rgb.dtype} {rgb.shape}")
    return rgb
