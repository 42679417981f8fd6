"""What in a colour picture isn't background: a probability per pixel, and the background itself where nobody gives it.

A pixel of the background keeps its colour, but for a gain that the whole picture shares (brightness) and Gaussian
noise; a pixel of anything else has any colour with the same probability. Both gain and noise are estimated from the
picture by medians, which hold as long as most of it is background. Where the background is a bad guess, the noise
comes out large and probabilities go towards what colours can't tell: the picture says less instead of something wrong.
"""

from collections import deque

import numpy as np

from motionenv.errors import MotionError

_DARK = 24  # grey levels; darker pixels say nothing of the gain
_LEAST_NOISE = 1.0  # grey levels: rounding, and what else is never quite the same
_TO_DEVIATION = 1.4826  # median absolute deviation → standard deviation of a Gaussian


def foreground_probability(rgb, background, *, noise: float | None = None) -> np.ndarray:
    """Probability (height, width) that a pixel isn't background, both being as likely beforehand.

    Args:
        rgb: uint8 (height, width, 3), the picture.
        background: (height, width, 3), the same view without anybody, 0 to 255.
        noise: standard deviation of colours [grey levels]; None estimates it from the picture.

    Raises:
        MotionError: shapes that don't go together, or noise that isn't above 0.
    """
    rgb = picture(rgb)
    background = np.asarray(background, dtype=np.float64)
    if background.shape != rgb.shape or not np.isfinite(background).all():
        raise MotionError(f"background must be finite and of the picture's shape {rgb.shape}, got {background.shape}")
    if noise is not None and not 0 < noise < np.inf:
        raise MotionError(f"noise must be a number of grey levels above 0, got {noise!r}")
    bright = background > _DARK
    gain = float(np.median(rgb[bright] / background[bright])) if bright.any() else 1.0
    difference = rgb - gain * background
    sigma = max(_TO_DEVIATION * float(np.median(np.abs(difference))), _LEAST_NOISE) if noise is None else noise
    log_odds = 0.5 * (difference**2).sum(-1) / sigma**2 - 3 * np.log(256 / (sigma * np.sqrt(2 * np.pi)))
    return 1.0 / (1.0 + np.exp(-np.clip(log_odds, -50.0, 50.0)))


class Background:
    """A running estimate of the background from the pictures of a camera that stands still.

    From `least` pictures on it is the median of the last `frames`, per pixel: right where a walker stood in fewer than
    half of them. Before, and with a camera that pans, each row's median colour stands in for it: right for plain walls
    and skies, and a bad guess, that says so by its residuals, for anything else.

    Args:
        frames: how many pictures to keep.
        least: how many are needed for the median over time.
        still: False for a camera that pans.
    """

    def __init__(self, frames: int = 31, least: int = 8, *, still: bool = True):
        if not 1 <= least <= frames:
            raise MotionError(f"least must be from 1 to frames, got least = {least!r} and frames = {frames!r}")
        self.least, self.still = least, still
        self._pictures: deque[np.ndarray] = deque(maxlen=frames)

    def observe(self, rgb) -> None:
        """Take in a picture, uint8 `rgb` (height, width, 3).

        Raises:
            MotionError: not such a picture, or of another size than those before.
        """
        rgb = picture(rgb)
        if self._pictures and self._pictures[0].shape != rgb.shape:
            raise MotionError(f"pictures so far are {self._pictures[0].shape}, this one is {rgb.shape}: start anew")
        self._pictures.append(rgb.copy())

    def estimate(self) -> np.ndarray:
        """The background (height, width, 3), 0 to 255.

        Raises:
            MotionError: no picture yet.
        """
        if not self._pictures:
            raise MotionError("no picture has been observed yet: call observe(rgb) first")
        if self.still and len(self._pictures) >= self.least:
            middle = len(self._pictures) // 2
            return np.partition(np.stack(self._pictures, axis=-1), middle, axis=-1)[..., middle]
        last = self._pictures[-1]
        return np.broadcast_to(np.median(last, axis=1, keepdims=True), last.shape)


def picture(rgb) -> np.ndarray:
    """`rgb` as an array.

    Raises:
        MotionError: not uint8 (height, width, 3).
    """
    rgb = np.asarray(rgb)
    if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[-1] != 3 or not rgb.size:
        raise MotionError(f"rgb must be uint8 (height, width, 3), got {rgb.dtype} {rgb.shape}")
    return rgb
