"""What the figures share: colours, an empty figure, and what they ask of their data."""

import numpy as np

from motionenv.errors import MotionError

BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "0.35"  # apart for colour-blind eyes too


def finite(array: np.ndarray, name: str) -> np.ndarray:
    """`array`, if all of it is there.

    Raises:
        MotionError: NaN or infinite values.
    """
    if not np.isfinite(array).all():
        raise MotionError(f"{name} has NaN or infinite values: draw a stretch without gaps")
    return array


def one_each(labels, count: int, name: str) -> tuple[str, ...]:
    """`labels` as a tuple of `count`, at least one.

    Raises:
        MotionError: another number.
    """
    labels = tuple(labels)
    if not labels or len(labels) != count:
        raise MotionError(f"{name} must hold one label for each of {count} panels, got {labels}")
    return labels


def new_figure(rows: int, columns: int, size: tuple[float, float], *, sharex: bool = True):
    """A figure that pyplot knows nothing of, so that no state is shared, and its axes (rows, columns).

    Raises:
        MotionError: matplotlib isn't installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise MotionError("figures need matplotlib: pip install 'motionenv[plots]'") from None
    figure = Figure(figsize=size, dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, sharex=sharex, sharey="row", squeeze=False)
    for panel in axes.flat:
        panel.spines[["top", "right"]].set_visible(False)
    return figure, axes
