"""Notice a moving camera: most of the picture moves as a whole.

The picture is cut into blocks. Where a block half a second later fits better when shifted, it has moved; where it fits
best in place, it's still. People move a few blocks, a camera that pans, zooms or shakes nearly all with structure.
"""

import numpy as np

from motionenv.errors import MotionError

_LAG = 0.5  # [s]
_BLOCKS = 4  # blocks along each side
_LEAST_SHIFT, _BETTER = 1.0, 0.7  # [pixels]; residual after the shift, relative to that in place
_TEXTURE = 3.0  # [grey levels] least standard deviation of a block that can tell
_MOST_BLOCKS, _MOST_PAIRS = 0.6, 0.25  # share of blocks that move in a pair of frames, and share of such pairs
_FEWEST = 4  # blocks that must be able to tell


def moving_share(frames: np.ndarray, fps: float) -> float:
    """Share of pairs of frames, `_LAG` apart, between which the camera moves.

    `frames` are uint8 (T, height, width, 3) at `fps` [Hz].
    """
    grey = np.asarray(frames).mean(axis=-1, dtype=np.float32)
    rows, columns = (n // _BLOCKS for n in grey.shape[1:])
    lag = min(max(1, round(_LAG * fps)), len(grey) - 1)
    cut = grey[:, : rows * _BLOCKS, : columns * _BLOCKS].reshape(len(grey), _BLOCKS, rows, _BLOCKS, columns)
    blocks = cut.transpose(0, 1, 3, 2, 4).reshape(len(grey), -1, rows, columns)
    return float(np.mean([_moves(blocks[i], blocks[i + lag]) for i in range(0, len(grey) - lag, max(1, lag // 4))]))


def refuse_moving(frames: np.ndarray, fps: float) -> None:
    """Refuse a film, `frames` and `fps` as in `moving_share`, by a moving camera.

    Raises:
        MotionError: the camera moves.
    """
    share = moving_share(frames, fps)
    if share > _MOST_PAIRS:
        raise MotionError(
            f"the camera moves: most of the picture shifts in {share:.0%} of the film. Tracking needs a camera that "
            "stands still: use a tripod, cut the film to where it stands, or stabilise it first"
        )


def _moves(before: np.ndarray, after: np.ndarray) -> bool:
    """Whether most blocks (n, rows, columns) with structure move from one frame to another."""
    one, other = (b - b.mean(axis=(1, 2), keepdims=True) for b in (before, after))
    textured = one.std(axis=(1, 2)) > _TEXTURE
    if textured.sum() < _FEWEST:
        return False
    return bool(np.mean([_shifted(a, b) for a, b in zip(one[textured], other[textured], strict=True)]) > _MOST_BLOCKS)


def _shifted(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether a block (rows, columns) fits another better when shifted by a pixel or more, by phase correlation."""
    taper = np.outer(np.hanning(one.shape[0]), np.hanning(one.shape[1]))
    spectrum = np.conj(np.fft.rfft2(one * taper)) * np.fft.rfft2(other * taper)
    peak = np.fft.irfft2(spectrum / (np.abs(spectrum) + 1e-3 * np.abs(spectrum).max() + 1e-9), s=one.shape)
    half = np.array(one.shape) // 2
    down, right = (np.array(np.unravel_index(peak.argmax(), one.shape)) + half) % one.shape - half
    if np.hypot(down, right) < _LEAST_SHIFT or (np.abs([down, right]) >= half).any():
        return False
    here = (slice(max(0, -down), one.shape[0] - max(0, down)), slice(max(0, -right), one.shape[1] - max(0, right)))
    there = (slice(max(0, down), one.shape[0] + min(0, down)), slice(max(0, right), one.shape[1] + min(0, right)))
    return bool(np.abs(other[there] - one[here]).mean() < _BETTER * np.abs(other[here] - one[here]).mean())
