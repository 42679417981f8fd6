"""Figures of what models learned: cycle lengths, components, their variance, coefficients of draws."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.errors import MotionError
from motionenv.plots._drawing import BLUE, GREEN, GREY, ORANGE, finite, new_figure
from motionenv.types import frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    figure, axes = new_figure(1, 1, (5.5, 3.2))
    axes[0, 0].plot(periods, snr, color=BLUE)
    if best is not None:
        axes[0, 0].axvline(best, color=ORANGE, linewidth=1, label=f"{best:.3f} s")
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
    figure, axes = new_figure(len(show), len(modes), (2.2 * len(modes) + 0.6, 2.0 * len(show) + 0.6))
    for row, name in zip(axes, show, strict=True):
        i = channels.index(name)
        for k, panel in enumerate(row):
            for shift, colour, style in ((0, GREY, "-"), (1, BLUE, "-"), (-1, ORANGE, "--")):
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
    figure, axes = new_figure(1, 1, (4.8, 3.2))
    axes[0, 0].plot(np.arange(1, len(ratios) + 1), share, color=BLUE)
    if marked is not None:
        label = f"{marked} components: {share[marked - 1]:.1f} %"
        axes[0, 0].plot([marked], [share[marked - 1]], "o", color=GREEN, label=label)
        axes[0, 0].legend(frameon=False, loc="lower right")
    axes[0, 0].set(xlabel="number of components", ylabel="cumulative variance [%]", ylim=(0, 102))
    return figure


def coefficient_histograms(draws, probe, temperature: float, *, show=(3, 7, 11, 15), bins: int = 40) -> "Figure":
    """How single coefficients of drawn windows are distributed, beside the Gaussian model (paper C, fig. 4).

    Args:
        draws: {name: (n, b)} coefficients over their standard deviations, c / σ, of the windows that each way to draw
            gave for one probe.
        probe: (b,) those of the probe.
        temperature: β they were drawn with.
        show: which coefficients to draw, counted from 1 as in the paper, one panel each.
        bins: how many.

    Returns:
        Densities over c / σ: a step line for each way to draw, the Gaussian N(c_t / σ, β) dashed.

    Raises:
        MotionError: shapes that don't go together, NaN, β not above 0, or no coefficient of that number.
    """
    probe = finite(frozen(probe, (None,), "probe"), "probe")
    draws = {name: finite(frozen(z, (None, len(probe)), f"draws of {name}"), name) for name, z in draws.items()}
    if not draws or not all(len(z) for z in draws.values()) or not 0 < temperature < np.inf:
        raise MotionError(f"there must be draws, and a temperature above 0; got {list(draws)}, {temperature!r}")
    if not show or not all(1 <= k <= len(probe) for k in show):
        raise MotionError(f"show must name coefficients from 1 to {len(probe)}, got {tuple(show)}")
    figure, axes = new_figure(1, len(show), (2.2 * len(show) + 0.6, 2.8), sharex=False)
    for panel, k in zip(axes[0], show, strict=True):
        columns = [z[:, k - 1] for z in draws.values()]
        centre, width = probe[k - 1], np.sqrt(temperature)
        ends = [*np.concatenate(columns), centre - 3 * width, centre + 3 * width]
        x = np.linspace(min(ends), max(ends), bins + 1)
        for name, column, colour in zip(draws, columns, (BLUE, ORANGE, GREEN), strict=False):
            panel.stairs(np.histogram(column, x, density=True)[0], x, color=colour, label=name)
        fine = np.linspace(x[0], x[-1], 400)
        bell = np.exp(-0.5 * ((fine - centre) / width) ** 2) / (width * np.sqrt(2 * np.pi))
        panel.plot(fine, bell, "--", color=GREY, linewidth=1, label="Gaussian")
        panel.set(xlabel=f"coefficient {k} [σ]", xlim=(x[0], x[-1]))
    axes[0, 0].set_ylabel("density [1/σ]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False, fontsize="small")
    return figure
