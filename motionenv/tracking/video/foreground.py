"""Background subtraction for a static camera: a background model of a whole video, and foreground probabilities.

The background is what a pixel shows most steadily: the middle of the shortest interval of grey levels that holds half
of the frames (Rousseeuw's shorth). Its noise is what changes from a frame to the `_LAG`th after it, which somebody who
walks on hardly adds to, nor who comes nearer and covers a pixel for long. Noise of compression and sensors varies over
the image (edges, leaves, screens), hence a deviation per pixel. A shadow darkens all colours of a pixel by the same
factor, which a body seldom does (Horprasert, Harwood & Davis 1999): changes that a gain below one explains count as
background, with a penalty. `_LAG` and `_MOST_NOISE` were chosen on the development films of
`benchmarks/tracking/choosing.py`.
"""

from collections.abc import Sequence

import numpy as np

from motionenv.errors import MotionError
from motionenv.likelihoods.background import picture

_DARK = 24.0  # grey levels; darker pixels don't determine the gain
_VISIBLE, _LAG = 0.5, 10  # share of the frames that show the background; frames between which noise is measured
_LEAST_NOISE, _MOST_NOISE = 3.0, 2.0  # grey levels; factor on the image's median noise
_TO_DEVIATION = 1.4826  # median absolute deviation → standard deviation of a Gaussian
_SHADOW = 0.6  # gain of the darkest shadow
_SHADOW_COST = 3.0  # prior log-odds of background without shadow against shadow
_MOST_FRAMES = 90  # most frames of a video from which the background is estimated
_SURE = 6.0  # cap on one pixel's log-odds before smoothing over its neighbours
_PRIOR = 2.0  # prior log-odds of background


class FilmBackground:
    """Background model of a video by a static camera.

    `frames`, uint8 (T, height, width, 3), are all frames of the video or equally spaced ones.

    Raises:
        MotionError: fewer than three frames, or arrays of another kind.

    Attributes:
        typical: (height, width, 3), 0 to 255.
        noise: (height, width, 1) standard deviation [grey levels].
    """

    def __init__(self, frames: Sequence[np.ndarray] | np.ndarray) -> None:
        if len(frames) < 3:
            raise MotionError(f"a background needs at least 3 frames, got {len(frames)}")
        chosen = np.linspace(0, len(frames) - 1, min(len(frames), _MOST_FRAMES)).round().astype(int)
        some = np.stack([picture(frames[i]) for i in chosen])
        lag = min(_LAG, len(some) - 1)
        change = np.abs(some[lag:].astype(np.int16) - some[:-lag]).max(axis=-1)
        deviation = np.median(change, axis=0) * (_TO_DEVIATION / np.sqrt(2))
        some.sort(axis=0)
        held = max(2, round(_VISIBLE * len(some)))
        start = (some[held - 1 :] - some[: 1 - held]).argmin(axis=0)
        self.typical = np.take_along_axis(some, (start + held // 2)[None], axis=0)[0].astype(np.float32)
        most = _MOST_NOISE * max(float(np.median(deviation)), _LEAST_NOISE)
        self.noise = np.clip(deviation, _LEAST_NOISE, most)[..., None]

    def foreground(self, rgb: np.ndarray) -> np.ndarray:
        """Probability (height, width) that a pixel of `rgb` (height, width, 3) is foreground.

        Raises:
            MotionError: an image of another size.
        """
        from scipy.ndimage import uniform_filter

        rgb = picture(rgb).astype(np.float32)
        if rgb.shape != self.typical.shape:
            raise MotionError(f"rgb must have the video's shape {self.typical.shape}, got {rgb.shape}")
        bright = self.typical > _DARK
        gain = float(np.median(rgb[bright] / self.typical[bright])) if bright.any() else 1.0
        expected = gain * self.typical
        # Separate background images may be less noisy than the video, most of which is background: use its noise.
        noise = np.maximum(self.noise, _TO_DEVIATION * float(np.median(np.abs(rgb - expected))))
        spread = np.log(256 / (noise[..., 0] * np.sqrt(2 * np.pi)))
        plain = 0.5 * (((rgb - expected) / noise) ** 2).sum(axis=-1)
        darker = (rgb * expected).sum(axis=-1) / np.maximum((expected**2).sum(axis=-1), 1.0)
        shade = np.clip(darker, _SHADOW, 1.0)[..., None]
        shadow = 0.5 * (((rgb - shade * expected) / noise) ** 2).sum(axis=-1) + _SHADOW_COST
        log_odds = np.minimum(plain, shadow) - 3 * spread - _PRIOR
        smooth = uniform_filter(np.clip(log_odds, -_SURE, _SURE), 3, mode="nearest")
        return 1.0 / (1.0 + np.exp(-smooth.astype(np.float64)))
