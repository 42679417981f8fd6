"""Figures of lifting: errors and recovered angles over the angle of view (paper B, figs. 3, 5 and 6)."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.errors import MotionError
from motionenv.plots._drawing import BLUE, GREEN, GREY, ORANGE, finite, new_figure
from motionenv.types import frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LINES = ((BLUE, "-"), (ORANGE, "--"), (GREEN, "-."), (GREY, ":"))
_TICKS = np.arange(-90, 91, 30)


def error_over_variance(variances, errors, *, chosen: float | None = None) -> "Figure":
    """What the assumed variance of the noise does to the reconstruction (paper B, fig. 3).

    Args:
        variances: (n,) candidate σ² [mm²].
        errors: {name: (n,)} average error E_a of each way to reconstruct [mm²].
        chosen: a σ² to mark by an upright line [mm²].

    Raises:
        MotionError: rows that are not equally long or not finite, more of them than can be told apart, or none.
    """
    variances, errors = _curves(variances, errors, "variances")
    figure, axes = new_figure(1, 1, (5.0, 3.4))
    panel = axes[0, 0]
    _draw(panel, variances, errors)
    if chosen is not None:
        panel.axvline(chosen, color=GREY, linewidth=1, label=f"σ² = {chosen:g} mm²")
    panel.set(xlabel="variance σ² [mm²]", ylabel="mean squared error [mm²]", xlim=(0, variances[-1]), ylim=(0, None))
    panel.legend(frameon=False)
    return figure


def over_views(alphas, curves, label: str) -> "Figure":
    """Figures of reconstruction over the angle of view: errors, variance (paper B, figs. 5 a to c).

    Args:
        alphas: (n,) view angles [rad]; 0 is the side, ±90° front and back.
        curves: {name: (n,)} of each way to reconstruct, in the units that `label` names.
        label: what the curves are, with units.

    Raises:
        MotionError: as `error_over_variance`.
    """
    alphas, curves = _curves(alphas, curves, "alphas")
    figure, axes = new_figure(1, 1, (5.0, 3.4))
    _draw(axes[0, 0], np.rad2deg(alphas), curves)
    axes[0, 0].set(xlabel="view angle [°]", ylabel=label, xticks=_TICKS, xlim=(-90, 90), ylim=(0, None))
    if len(curves) > 1:
        axes[0, 0].legend(frameon=False)
    return figure


def recovered_views(alphas, errors) -> "Figure":
    """Angles of view that were found, over the true ones: mean and standard deviation (paper B, fig. 6).

    Args:
        alphas: (n,) true view angles [rad].
        errors: {name: (walks, n)} angle found less the true one [rad], within ±π, of each way to find it; a panel each.

    Raises:
        MotionError: another shape, not finite, or nothing to draw.
    """
    alphas = finite(frozen(alphas, (None,), "alphas"), "alphas")
    errors = {name: finite(frozen(e, (None, len(alphas)), f"errors of {name}"), name) for name, e in errors.items()}
    if not errors or not len(alphas) or not all(len(e) for e in errors.values()):
        raise MotionError(f"there must be angles, and errors of at least one walk; got {list(errors)}")
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
    figure.get_layout_engine().set(wspace=0.1)  # or the last tick's label meets the next panel's first
    axes[0, 0].legend(frameon=False, fontsize="small")
    return figure


def _draw(panel, x: np.ndarray, curves: dict[str, np.ndarray]) -> None:
    for (name, y), (colour, style) in zip(curves.items(), _LINES, strict=False):
        panel.plot(x, y, style, color=colour, label=name)


def _curves(x, curves, name: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """`x` (n,) and each of `curves` (n,).

    Raises:
        MotionError: they are not equally long rows of numbers, or there are none, or more than there are colours.
    """
    x = finite(frozen(x, (None,), name), name)
    curves = {key: finite(frozen(y, (len(x),), f"curve of {key}"), key) for key, y in curves.items()}
    if not len(x) or not 1 <= len(curves) <= len(_LINES):
        raise MotionError(f"there must be {name} and 1 to {len(_LINES)} curves, got {len(x)} and {list(curves)}")
    return x, curves
