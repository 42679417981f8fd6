"""Background subtraction before a still camera whose background nobody has seen, from the second picture on.

Each pixel is a hidden Markov model, after Rittscher, Kato, Joga and Blake (A probabilistic background model for
tracking, ECCV 2000), whose background colour is unknown, too. It shows its background, whose colour stays, or something
that passes, whose colour stays for a while and then is any other. Which of a pixel's colours is its background follows
from all pictures so far: it was there before something came and is there again afterwards. A median, by contrast, needs
many pictures, and takes for background whatever was there for half of the time.
"""

from __future__ import annotations

import numpy as np

from motionenv.errors import MotionError
from motionenv.likelihoods.background import DARK, LEAST_NOISE, TO_DEVIATION, picture

# Chosen by the log loss of 24 episodes of WalkerTracking-Hard's split "train"; half or twice as much hardly matters.
_SHARE = 0.01  # of pixels that show something that passes, before anything is known
_STAYS, _LASTS = 15.0, 0.7  # frames for which it is seen at a pixel; probability that its colour is the last frame's
_COLOURS, _ALIKE = 3, 4.0  # at a pixel that may be its background; standard deviations within which they are the same
_SMOOTHED = 50  # frames over which the noise is averaged
_CHANGES = 1e-100  # least probability that a background hasn't been seen: one that changes is learned in 5 to 10 s


class PixelHistory:
    """Probabilities of what pictures of a still camera have shown of a background.

    Attributes:
        frames: number of pictures seen.
    """

    def __init__(self) -> None:
        self.frames = 0

    def observe(self, rgb: np.ndarray) -> np.ndarray:
        """Add a picture, uint8 `rgb` (height, width, 3); returns probabilities (height, width) of foreground.

        Raises:
            MotionError: another type, or another size than before.
        """
        rgb = picture(rgb)
        if not self.frames:
            self._begin(rgb)
        elif rgb.shape != self._shape:
            raise MotionError(f"rgb must have the shape of earlier pictures {self._shape}, got {rgb.shape}")
        else:
            self._add(self._lit(rgb))
        self.frames += 1
        return np.minimum(self._unseen + self._covered.sum(axis=1), 1.0).reshape(self._shape[:2])

    def foreground(self, rgb: np.ndarray) -> np.ndarray:
        """As `observe` returns, for an earlier picture `rgb`, given all that is known now."""
        if self.frames < 2:
            return np.full(self._shape[:2], _SHARE)
        shown = (1 - _SHARE) * self._shows(self._apart(self._lit(picture(rgb))))
        passing = ((self._bare + self._covered) * _SHARE / (_SHARE + shown)).sum(axis=1)
        return np.minimum(self._unseen + passing, 1.0).reshape(self._shape[:2])

    def _begin(self, rgb: np.ndarray) -> None:
        """Each pixel's first colour is its background, or of something before a background that hasn't been seen."""
        self._shape, n = rgb.shape, rgb.shape[0] * rgb.shape[1]
        self._last = rgb.reshape(n, 3).astype(np.float64)
        self._colours, self._seen = np.zeros((n, _COLOURS, 3)), np.zeros((n, _COLOURS))
        self._colours[:, 0], self._seen[:, 0] = self._last, 1
        # Probabilities that a colour is the background and shows, is it and is covered, and that none of them is it.
        self._bare, self._covered = np.zeros((n, _COLOURS)), np.zeros((n, _COLOURS))
        self._bare[:, 0], self._unseen = 1 - _SHARE, np.full(n, _SHARE)
        self._variance = 0.0

    def _add(self, colours: np.ndarray) -> None:
        """One step of the forward algorithm, with densities relative to the uniform one."""
        change = colours - self._last
        variance = max((TO_DEVIATION * float(np.median(np.abs(change)))) ** 2 / 2, LEAST_NOISE**2)
        self._variance += (variance - self._variance) / min(self.frames, _SMOOTHED)
        passing = _LASTS * _density((change**2).sum(axis=-1) / 2 / self._variance, 2 * self._variance) + (1 - _LASTS)
        leaves, comes = 1 / _STAYS, _SHARE / (1 - _SHARE) / _STAYS
        apart = self._apart(colours)
        bare = self._shows(apart) * ((1 - comes) * self._bare + leaves * self._covered)
        covered = passing[:, None] * (comes * self._bare + (1 - leaves) * self._covered)
        # Where nothing has shown the background, this may: a colour that was seen before, or a new one.
        apart[self._seen == 0] = np.inf
        known = apart.min(axis=1) < _ALIKE**2
        rows, at = np.arange(len(colours)), np.where(known, apart.argmin(axis=1), np.argmin(bare + covered, axis=1))
        bare[rows, at], covered[rows, at] = bare[rows, at] * known + leaves * self._unseen, covered[rows, at] * known
        self._seen[rows, at] = self._seen[rows, at] * known + 1
        self._colours[rows, at] += (colours - self._colours[rows, at]) / self._seen[rows, at, None]
        unseen = (1 - leaves) * passing * self._unseen
        total = unseen + (bare + covered).sum(axis=1)
        self._bare, self._covered = bare / total[:, None], covered / total[:, None]
        self._unseen, self._last = np.maximum(unseen / total, _CHANGES), colours

    def _lit(self, rgb: np.ndarray) -> np.ndarray:
        """A picture's colours (pixels, 3) in the light of the first one: a gain of the whole picture is removed."""
        colours = rgb.reshape(-1, 3).astype(np.float64)
        likeliest = (self._bare + self._covered).argmax(axis=1)
        background = self._colours[np.arange(len(colours)), likeliest]
        bright = background > DARK
        return colours / np.median(colours[bright] / background[bright]) if bright.any() else colours

    def _shows(self, apart: np.ndarray) -> np.ndarray:
        """Densities (pixels, colours) of pictures `apart` from a pixel's known colours, if each is the background."""
        return _density(apart, self._variance) / self._wider() ** 1.5

    def _apart(self, colours: np.ndarray) -> np.ndarray:
        """Squared distances of `colours` from a pixel's known ones, in variances of their difference."""
        return ((colours[:, None] - self._colours) ** 2).sum(axis=-1) / (self._variance * self._wider())

    def _wider(self) -> np.ndarray:
        """By how much a colour's variance is greater than the noise's, as it is the mean of those seen."""
        return 1 + 1 / np.maximum(self._seen, 1)


def _density(apart: np.ndarray, variance: float) -> np.ndarray:
    """Of Gaussian colours whose squared distances from the mean are `apart` variances, relative to a uniform one's."""
    return np.exp(-0.5 * apart) * 256.0**3 / (2 * np.pi * variance) ** 1.5
