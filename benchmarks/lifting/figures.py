"""Figures of lifting: errors and recovered angles over the view angle (paper B, figs. 3, 5 and 6)."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.lifting.plot import BLUE, GREY, ORANGE, new_figure
from renders.plotting import GREEN

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LINES = ((BLUE, "-"), (ORANGE, "--"), (GREEN, "-."), (GREY, ":"))
_TICKS = np.arange(-90, 91, 30)


def error_over_variance(variances, errors, *, chosen: float | None = None) -> "Figure":
    """Reconstruction error over the assumed noise variance (paper B, fig. 3).

    Args:
        variances: (n,) candidate σ² [mm²].
        errors: {name: (n,)} average error E_a of each method [mm²].
        chosen: σ² to mark by a vertical line [mm²].
    """
    figure, axes = new_figure(1, 1, (5.0, 3.4))
    panel = axes[0, 0]
    _draw(panel, variances, errors)
    if chosen is not None:
        panel.axvline(chosen, color=GREY, linewidth=1, label=f"σ² = {chosen:g} mm²")
    panel.set(xlabel="variance σ² [mm²]", ylabel="mean squared error [mm²]", xlim=(0, variances[-1]), ylim=(0, None))
    panel.legend(frameon=False)
    return figure


def over_views(alphas, curves, label: str) -> "Figure":
    """Curves over the view angle: errors, variance (paper B, figs. 5 a to c).

    Args:
        alphas: (n,) view angles [rad]; 0 is the side, ±90° front and back.
        curves: {name: (n,)} values for each method, in the unit of `label`.
        label: label of the vertical axis, with unit.
    """
    figure, axes = new_figure(1, 1, (5.0, 3.4))
    _draw(axes[0, 0], np.rad2deg(alphas), curves)
    axes[0, 0].set(xlabel="view angle [°]", ylabel=label, xticks=_TICKS, xlim=(-90, 90), ylim=(0, None))
    if len(curves) > 1:
        axes[0, 0].legend(frameon=False)
    return figure


def recovered_views(alphas, errors) -> "Figure":
    """Estimated over true view angles: mean and standard deviation (paper B, fig. 6).

    Args:
        alphas: (n,) true view angles [rad].
        errors: {name: (walks, n)} estimated minus true angle [rad], within ±π, for each method; one panel each.
    """
    degrees = np.rad2deg(alphas)
    figure, axes = new_figure(1, len(errors), (3.6 * len(errors) + 0.4, 3.6))
    for panel, (name, error) in zip(axes[0], errors.items(), strict=True):
        mean, deviation = degrees + np.rad2deg(error.mean(axis=0)), np.rad2deg(error.std(axis=0))
        panel.plot(degrees, mean, color=BLUE, label="mean")
        for sign in (1, -1):
            label = "± 1 standard deviation" if sign == 1 else None
            panel.plot(degrees, mean + sign * deviation, "--", color=ORANGE, linewidth=1, label=label)
        panel.plot(degrees, degrees, ":", color=GREY, linewidth=1, label="true")
        panel.set(xlabel="view angle [°]", title=name, xticks=_TICKS, yticks=_TICKS, xlim=(-90, 90))
    axes[0, 0].set_ylabel("angle found [°]")
    figure.get_layout_engine().set(wspace=0.1)  # otherwise tick labels of neighbouring panels touch
    axes[0, 0].legend(frameon=False, fontsize="small")
    return figure


def _draw(panel, x: np.ndarray, curves: dict[str, np.ndarray]) -> None:
    for (name, y), (colour, style) in zip(curves.items(), _LINES[: len(curves)], strict=True):
        panel.plot(x, y, style, color=colour, label=name)
