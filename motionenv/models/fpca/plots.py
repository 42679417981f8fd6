"""The usual pictures of a functional PCA: modes, scree, scores, residuals. They need the extra `plots`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from motionenv._core.figures import BLUE, GREY, ORANGE, new_figure
from motionenv.errors import MotionError
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.types import Cycles

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def components(fpca: FunctionalPCA, channels: Sequence[str] | None = None, n: int = 3) -> Figure:
    """The mean ± 2 standard deviations along each of the first `n` components, in the channels' units.

    `channels` are by default the six whose cycles differ most. A `MotionError` if the model doesn't know one.
    """
    n = min(n, fpca.n_components_)
    deviations = np.sqrt(fpca.explained_variance_)[:, None, None] * fpca.components_
    most = np.argsort(-(deviations**2).sum(axis=(0, 1)), kind="stable")[:6]
    names = [fpca.channels_[i] for i in sorted(most)] if channels is None else list(channels)
    if not names or (unknown := sorted(set(names) - set(fpca.channels_))):
        raise MotionError(f"channels must be some of {', '.join(fpca.channels_)}; got {', '.join(unknown) or 'none'}")
    figure, axes = new_figure(n, len(names), (2.2 * len(names), 2.0 * n + 0.3), sharey="col")
    percent = 100 * np.arange(len(fpca.mean_)) / len(fpca.mean_)
    for row, panels in enumerate(axes):
        for panel, name in zip(panels, names, strict=True):
            i = fpca.channels_.index(name)
            mean, step = fpca.mean_[:, i], 2 * deviations[row, :, i]
            panel.plot(percent, mean, color="black", linewidth=1, label="mean")
            panel.plot(percent, mean + step, color=BLUE, label="+ 2 SD")
            panel.plot(percent, mean - step, "--", color=ORANGE, label="- 2 SD")
            if row == 0:
                panel.set_title(name.replace("_", " "), fontsize="small")
        panels[0].set_ylabel(f"component {row + 1}\n{fpca.explained_variance_ratio_[row]:.0%} of variance")
    for panel in axes[-1]:
        panel.set_xlabel("cycle [%]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def scree(fpca: FunctionalPCA) -> Figure:
    """Shares of the model's variance, and the held-out likelihood by number of components if that chose it."""
    curve = fpca.selection_
    figure, axes = new_figure(1, 1 if curve is None else 2, (4.0 if curve is None else 8.0, 3.0), sharey="none")
    panel, shares = axes[0, 0], 100 * fpca.explained_variance_ratio_
    number = np.arange(1, len(shares) + 1)
    panel.bar(number, shares, color=GREY, label="each")
    panel.plot(number, shares.cumsum(), ".-", color=BLUE, label="together")
    panel.axhline(100 * (1 - fpca.noise_ratio_), color=GREY, linestyle=":", label="all but residuals")
    panel.set(xlabel="component", ylabel="share of variance [%]", ylim=(0, 100))
    panel.legend(frameon=False, fontsize="small")
    if curve is not None:
        axes[0, 1].errorbar(curve.n_components, curve.score, curve.error, fmt=".-", color=BLUE)
        axes[0, 1].axvline(curve.best, color=GREY, linestyle="--")
        axes[0, 1].set(xlabel="components", ylabel="log-likelihood per sample", title="cycles of people left out")
    return figure


def scores(fpca: FunctionalPCA, cycles: Cycles, pair: tuple[int, int] = (0, 1)) -> Figure:
    """Scores of `cycles` along a `pair` of components, one colour a person, with the SD of what gaps leave open."""
    if max(pair) >= fpca.n_components_:
        raise MotionError(f"pair must be two of the components 0 to {fpca.n_components_ - 1}, got {pair}")
    where, covariance = fpca.transform(cycles, return_cov=True)
    unsure = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    figure, axes = new_figure(1, 1, (5.0, 4.0))
    panel, people = axes[0, 0], np.asarray(cycles.subject)
    for person in np.unique(people):
        own = people == person
        (x, y), (dx, dy) = where[own][:, pair].T, unsure[own][:, pair].T
        panel.errorbar(x, y, dy, dx, fmt=".", elinewidth=0.5, label=str(person))
    panel.axhline(0, color=GREY, linewidth=0.5)
    panel.axvline(0, color=GREY, linewidth=0.5)
    panel.set(xlabel=f"score {pair[0] + 1}", ylabel=f"score {pair[1] + 1}")
    figure.legend(loc="outside right upper", fontsize="x-small", frameon=False, ncols=1 + len(np.unique(people)) // 20)
    return figure


def residuals(fpca: FunctionalPCA, cycles: Cycles) -> Figure:
    """What the components leave of `cycles`: its root mean square by channel and phase, over the model's residual SD.

    About 1 everywhere where the model holds; dark spots are where it doesn't.
    """
    values = cycles.values[..., [cycles.channels.index(name) for name in fpca.channels_]]
    left = values - fpca.inverse_transform(fpca.transform(values))
    count = np.maximum(np.isfinite(left).sum(axis=0), 1)
    ratio = np.sqrt(np.nansum(left**2, axis=0) / count / fpca.noise_variance_)
    figure, axes = new_figure(1, 1, (7.0, 0.6 + 0.2 * len(fpca.channels_)))
    panel = axes[0, 0]
    picture = panel.imshow(ratio.T, aspect="auto", cmap="Greys", vmin=0, vmax=3, extent=(0, 100, len(ratio.T), 0))
    panel.set_yticks(np.arange(len(fpca.channels_)) + 0.5, [name.replace("_", " ") for name in fpca.channels_])
    panel.set(xlabel="cycle [%]")
    figure.colorbar(picture, label="residual / its SD")
    return figure
