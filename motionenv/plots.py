"""Figures of the papers, as matplotlib `Figure`s: `figure.savefig("snr.png")`. Needs the `plots` extra."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.errors import MotionError
from motionenv.types import frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BLUE, _ORANGE, _GREEN, _GREY = "#0072b2", "#d55e00", "#009e73", "0.35"  # apart for colour-blind eyes too


def snr_curve(periods, snr, *, best: float | None = None) -> "Figure":
    """Signal-to-noise ratio over candidate cycle lengths (paper A, fig. 5, last row).

    Args:
        periods: (n,) candidate cycle lengths [s].
        snr: (n,) accumulated signal-to-noise ratio (eq. 3) of each.
        best: the cycle length that was chosen [s]; marked by an upright line.

    Raises:
        MotionError: `periods` and `snr` are not two equally long rows of numbers.
    """
    periods = frozen(periods, (None,), "periods")
    snr = frozen(snr, (len(periods),), "snr")
    figure, axes = _figure(1, 1, (5.5, 3.2))
    axes[0, 0].plot(periods, snr, color=_BLUE)
    if best is not None:
        axes[0, 0].axvline(best, color=_ORANGE, linewidth=1, label=f"{best:.3f} s")
        axes[0, 0].legend(frameon=False)
    axes[0, 0].set(xlabel="candidate cycle length [s]", ylabel="signal-to-noise ratio", xlim=(periods[0], periods[-1]))
    return figure


def components(mean, modes, channels, *, show=("left_hip_flexion", "left_elbow_flexion"), count: int = 4) -> "Figure":
    """Mean cycle of joint angles, and what adding and taking away each component makes of it (paper A, figs. 9, 10).

    Args:
        mean: (samples, channels) [rad], the mean cycle.
        modes: (q, samples, channels) [rad], each component times as many standard deviations as shall be shown.
        channels: a name per channel, such as `motionenv.types.ANGLES`.
        show: names of the channels to draw, one row each.
        count: how many components to draw, one column each, at most q.

    Returns:
        Angles in degrees over the share of the cycle in percent: mean grey, plus blue, minus orange and dashed.

    Raises:
        MotionError: shapes that don't go together, or a name in `show` that is no channel.
    """
    channels = tuple(channels)
    mean = frozen(mean, (None, len(channels)), "mean")
    modes = frozen(modes, (None, *mean.shape), "modes")[:count]
    missing = [name for name in show if name not in channels]
    if missing or not show or not len(modes):
        raise MotionError(f"show must name channels, and at least one component; not among the channels: {missing}")
    percent = np.arange(len(mean)) * 100 / len(mean)
    figure, axes = _figure(len(show), len(modes), (2.2 * len(modes) + 0.6, 2.0 * len(show) + 0.6))
    for row, name in zip(axes, show, strict=True):
        i = channels.index(name)
        for k, panel in enumerate(row):
            for shift, colour, style in ((0, _GREY, "-"), (1, _BLUE, "-"), (-1, _ORANGE, "--")):
                panel.plot(percent, np.rad2deg(mean[:, i] + shift * modes[k, :, i]), style, color=colour, linewidth=1.2)
            panel.set(xlim=(0, 100))
        row[0].set_ylabel(f"{name.replace('_', ' ')} [°]")
    for k, panel in enumerate(axes[0], 1):
        panel.set_title(f"component {k}", fontsize="medium")
    for panel in axes[-1]:
        panel.set_xlabel("cycle [%]")
    return figure


def variance_curve(ratios, *, marked: int | None = None) -> "Figure":
    """Cumulative share of the variance that the components cover (paper B, fig. 2).

    Args:
        ratios: (n,) share of each component, largest first, from 0 to 1.
        marked: a number of components to mark, with its share (paper B: 30 components, 95.5 %).

    Raises:
        MotionError: `ratios` are not shares, or `marked` is no number of components from 1 to n.
    """
    ratios = frozen(ratios, (None,), "ratios")
    if not len(ratios) or not (ratios >= 0).all() or ratios.sum() > 1 + 1e-9:
        raise MotionError(f"ratios must be shares of the variance, from 0 to 1 and at most 1 together, got {ratios}")
    if marked is not None and not 1 <= marked <= len(ratios):
        raise MotionError(f"marked must be a number of components from 1 to {len(ratios)}, got {marked!r}")
    share = 100 * np.cumsum(ratios)
    figure, axes = _figure(1, 1, (4.8, 3.2))
    axes[0, 0].plot(np.arange(1, len(ratios) + 1), share, color=_BLUE)
    if marked is not None:
        label = f"{marked} components: {share[marked - 1]:.1f} %"
        axes[0, 0].plot([marked], [share[marked - 1]], "o", color=_GREEN, label=label)
        axes[0, 0].legend(frameon=False, loc="lower right")
    axes[0, 0].set(xlabel="number of components", ylabel="cumulative variance [%]", ylim=(0, 102))
    return figure


def _figure(rows: int, columns: int, size: tuple[float, float]):
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
    axes = figure.subplots(rows, columns, sharex=True, sharey="row", squeeze=False)
    for panel in axes.flat:
        panel.spines[["top", "right"]].set_visible(False)
    return figure, axes
