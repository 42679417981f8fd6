"""Figure of a lifted walk: what was seen, what was not, and how sure that is (paper B, fig. 4, and beyond).

Needs the extra `plots`.
"""

from typing import TYPE_CHECKING

import numpy as np

from motionenv._core.figures import BLUE, GREY, ORANGE, new_figure
from motionenv.body import EDGES
from motionenv.lifting.pipeline import Lifted
from motionenv.types import MARKERS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_POSTURES = 5  # equally spaced in one second, about a cycle, as in fig. 4
_SHOWN = ("left_ankle", "right_ankle", "left_wrist", "right_wrist", "head")
_PELVIS = MARKERS.index("pelvis")


def lifted_walk(lifted: Lifted) -> "Figure":
    """The motion `lifted` beside its points, and beside the truth where that is known.

    Shows five postures of one second as the camera saw them (points black) and with the unseen depth across;
    below, the depth of single markers over time with 90 % bands. Estimates blue, truth orange and dashed, about the
    pelvis.
    """
    figure, axes = new_figure(3, _POSTURES, (11.0, 8.0), sharex=False)
    view, scale = _seen(lifted)
    own = _about_pelvis(lifted.positions) @ view.T
    truth = lifted.points.truth
    true = None if truth is None else _about_pelvis(truth.positions) @ view.T
    frames = np.linspace(0, min(lifted.points.fps, len(own) - 1), _POSTURES, endpoint=False)
    for column, frame in enumerate(frames.astype(int)):
        for row, plane in enumerate(([0, 1], [2, 1])):
            panel = axes[row, column]
            _stick(panel, own[frame][:, plane], BLUE, "-")
            if true is not None:
                _stick(panel, true[frame][:, plane], ORANGE, "--")
            panel.set(aspect="equal", xlim=(-0.8, 0.8), xlabel=("across [m]", "depth [m]")[row])
        points = lifted.points.upward[frame] / scale[frame]
        points = points - np.nanmedian(points - own[frame][:, :2], axis=0)  # where the estimate is on average
        axes[0, column].plot(*points.T, ".", color="black", markersize=3)
        axes[0, column].set_title(f"{frame / lifted.points.fps:.2f} s", fontsize="medium")
    axes[0, 0].set_ylabel("as seen: up [m]")
    axes[1, 0].set_ylabel("as not seen: up [m]")
    _over_time(axes[2], lifted, own, true, view)
    return figure


def _seen(lifted: Lifted) -> tuple[np.ndarray, np.ndarray]:
    """The picture's axes across, up and away (3, 3), and its units per metre (frames,)."""
    free = lifted.free
    ways = lifted.positions[:, _PELVIS] - free.origin
    away = ways.mean(axis=0) / np.linalg.norm(ways.mean(axis=0))
    across = np.cross(away, [0.0, 0.0, 1.0]) / np.linalg.norm(away[:2])
    scale = free.focal / (ways @ away) if lifted.points.unit == "px" else np.ones(len(ways))
    return np.stack([across, np.cross(across, away), away]), scale


def _about_pelvis(positions: np.ndarray) -> np.ndarray:
    return positions - positions[:, [_PELVIS]]


def _stick(panel, points: np.ndarray, colour: str, style: str) -> None:
    for a, b in EDGES:
        panel.plot(*points[[a, b]].T, style, color=colour, linewidth=1.2)


def _over_time(panels, lifted: Lifted, own: np.ndarray, true, view: np.ndarray) -> None:
    t = np.arange(len(own)) / lifted.points.fps
    band = np.sqrt((lifted.band**2) @ (view[2] ** 2))
    for panel, name in zip(panels, _SHOWN, strict=True):
        i = MARKERS.index(name)
        panel.fill_between(t, own[:, i, 2] - band[:, i], own[:, i, 2] + band[:, i], color=BLUE, alpha=0.2, linewidth=0)
        panel.plot(t, own[:, i, 2], color=BLUE, linewidth=1.2, label="lifted, 90 %")
        if true is not None:
            panel.plot(t, true[:, i, 2], "--", color=ORANGE, linewidth=1.2, label="truth")
        panel.axhline(0.0, color=GREY, linewidth=0.5)
        panel.set_xlabel("time [s]")
        panel.set_title(name.replace("_", " "), fontsize="medium")
    panels[0].set_ylabel("depth [m]")
    panels[0].figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False, fontsize="small"
    )
