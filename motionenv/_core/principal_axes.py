"""Signs and number of principal axes, so that the data decide them and not the rounding errors of a processor."""

import numpy as np

_TIE = 1e-4  # entries whose sizes differ by less than this share count as equal


def signs(axes: np.ndarray) -> np.ndarray:
    """Factors (k,) of 1 or -1 that make the largest entry of each of `axes` (k, d) positive.

    Of entries of nearly equal size, as left and right have in a symmetric walk, the first one decides.
    """
    size = np.abs(axes)
    first = (size > (1 - _TIE) * size.max(axis=1, keepdims=True)).argmax(axis=1)
    return np.where(np.take_along_axis(axes, first[:, None], axis=1)[:, 0] < 0, -1.0, 1.0)


def numerical_rank(singular_values: np.ndarray, shape: tuple[int, ...], scale: float) -> int:
    """Number of `singular_values` of a matrix of `shape` that exceed rounding errors.

    As `numpy.linalg.matrix_rank`, except that `scale` is the size of what was rounded: the norm of the data before
    their mean was subtracted.
    """
    return int((singular_values > max(shape) * np.finfo(np.float64).eps * scale).sum())
