"""The components of a functional PCA as a picture; needs the extra `plots`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from motionenv._core.figures import BLUE, ORANGE, new_figure
from motionenv.errors import MotionError
from motionenv.models.fpca.model import FunctionalPCA

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
