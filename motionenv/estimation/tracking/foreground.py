"""What moves before a camera that stands still: the background of a whole film, and what differs from it.

The background is the median over the film, pixel by pixel, and its noise the median deviation from it: right where
somebody stood in fewer than half of the frames. Compression and sensors make noise that differs from place to place
(edges, leaves, screens), hence a deviation per pixel. A shadow darkens all colours of a pixel alike, which a body
seldom does (Horprasert, Harwood & Davis 1999): what a gain below one explains counts as background, with a penalty.
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.background import picture

_DARK = 24.0  # grey levels; darker pixels say nothing of the gain
_LEAST_NOISE, _MOST_NOISE = 3.0, 4.0  # grey levels; times the picture's median
_TO_DEVIATION = 1.4826  # median absolute deviation → standard deviation of a Gaussian
_SHADOW = 0.6  # gain of the darkest shadow
_SHADOW_COST = 3.0  # log-odds that shadows are rarer than plain background
_MOST_FRAMES = 90  # of a film, that the median is taken over
_SURE = 6.0  # log-odds of one pixel at most, before its neighbours are asked
_PRIOR = 2.0  # log-odds that a pixel shows background


class FilmBackground:
    """The background of a film by a camera that stands still.

    Args:
        frames: uint8 (T, height, width, 3), all of the film or equally spaced frames of it.

    Raises:
        MotionError: fewer than three frames, or not such pictures.

    Attributes:
        median: (height, width, 3), 0 to 255.
        noise: (height, width, 1) standard deviation [grey levels].
    """

    def __init__(self, frames):
        if len(frames) < 3:
            raise MotionError(f"a background needs at least 3 frames of a film, got {len(frames)}")
        chosen = np.linspace(0, len(frames) - 1, min(len(frames), _MOST_FRAMES)).round().astype(int)
        some = np.stack([picture(frames[i]) for i in chosen])
        self.median = np.median(some, axis=0).astype(np.float32)
        deviation = np.median(np.abs(some - self.median).max(axis=-1), axis=0) * _TO_DEVIATION
        most = _MOST_NOISE * max(float(np.median(deviation)), _LEAST_NOISE)
        self.noise = np.clip(deviation, _LEAST_NOISE, most)[..., None]

    def foreground(self, rgb) -> np.ndarray:
        """Probability (height, width) that a pixel of `rgb` (height, width, 3) is something before the background.

        Raises:
            MotionError: not a picture of the film's size.
        """
        from scipy.ndimage import uniform_filter

        rgb = picture(rgb).astype(np.float32)
        if rgb.shape != self.median.shape:
            raise MotionError(f"the picture must be of the film's shape {self.median.shape}, got {rgb.shape}")
        bright = self.median > _DARK
        gain = float(np.median(rgb[bright] / self.median[bright])) if bright.any() else 1.0
        expected = gain * self.median
        # Pictures of the empty scene may be cleaner than the film: most of it is background, and says how noisy it is.
        noise = np.maximum(self.noise, _TO_DEVIATION * float(np.median(np.abs(rgb - expected))))
        spread = np.log(256 / (noise[..., 0] * np.sqrt(2 * np.pi)))
        plain = 0.5 * (((rgb - expected) / noise) ** 2).sum(axis=-1)
        darker = (rgb * expected).sum(axis=-1) / np.maximum((expected**2).sum(axis=-1), 1.0)
        shade = np.clip(darker, _SHADOW, 1.0)[..., None]
        shadow = 0.5 * (((rgb - shade * expected) / noise) ** 2).sum(axis=-1) + _SHADOW_COST
        log_odds = np.minimum(plain, shadow) - 3 * spread - _PRIOR
        smooth = uniform_filter(np.clip(log_odds, -_SURE, _SURE), 3, mode="nearest")
        return 1.0 / (1.0 + np.exp(-smooth.astype(np.float64)))
