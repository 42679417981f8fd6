"""Figures of matplotlib; needs the extra `plots`."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from motionenv.errors import MotionError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "0.35"  # apart for colour-blind eyes too


def new_figure(
    rows: int, columns: int, size: tuple[float, float], *, sharex: bool = True,
    sharey: Literal["none", "row", "col"] = "row",
) -> "tuple[Figure, np.ndarray]":  # fmt: skip
    """A figure that pyplot knows nothing of, so that no state is shared, and its axes (`rows`, `columns`).

    `size` is (width, height) [inches]; `sharex` and `sharey` say which panels share an axis, as in matplotlib. A
    `MotionError` if that isn't installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise MotionError("figures need matplotlib: pip install 'motionenv[plots]'") from None
    figure = Figure(figsize=size, dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, sharex=sharex, sharey=sharey, squeeze=False)
    for panel in axes.flat:
        panel.spines[["top", "right"]].set_visible(False)
    return figure, axes
