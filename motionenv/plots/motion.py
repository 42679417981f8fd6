"""Figures of motion: stick figures, and the ways of hands and feet."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.body import EDGES, LIMBS, limb_segments, markers
from motionenv.errors import MotionError
from motionenv.plots._drawing import BLUE, GREY, ORANGE, finite, new_figure, one_each
from motionenv.types import MARKERS, Motion, Skeleton, frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIDES = {"left": BLUE, "right": ORANGE}
_ANKLES = [MARKERS.index(f"{side}_ankle") for side in _SIDES]
_FEET = [LIMBS.index(f"{side}_foot") for side in _SIDES]
_TRACED = {"wrist": "--", "ankle": "-"}  # whose ways are drawn, and how


def pose_samples(probe, samples, skeleton: Skeleton, titles) -> "Figure":
    """Poses that may come next, over each other and seen from the side (paper C, fig. 3).

    Args:
        probe: (25,) [m, rad], the last pose before them.
        samples: (panels, n, 25) [m, rad], n draws in each panel, for instance at one temperature each.
        skeleton: the body.
        titles: one for each panel.

    Returns:
        Stick figures, forward to the right: the probe black, draws with left limbs blue and right limbs orange.

    Raises:
        MotionError: shapes that don't go together, or NaN.
    """
    probe = finite(frozen(probe, (25,), "probe"), "probe")
    samples = finite(frozen(samples, (None, None, 25), "samples"), "samples")
    titles = one_each(titles, len(samples), "titles")
    sticks, own = (_from_the_side(_sticks(poses, skeleton), probe) for poses in (samples, probe[None]))
    figure, axes = new_figure(1, len(samples), (2.0 * len(samples) + 0.4, 3.2))
    for panel, title, drawn in zip(axes[0], titles, sticks, strict=True):
        _draw_sticks(panel, drawn, _stick_colours(), alpha=0.4)
        _draw_sticks(panel, own, "black", linewidth=1.6)
        panel.set_title(title, fontsize="medium")
        panel.set(aspect="equal", xlabel="forward [m]")
    axes[0, 0].set_ylabel("height [m]")
    return figure


def trajectories(motion: Motion) -> "Figure":
    """A motion from the side: every pose grey, and the ways of hands and feet (paper C, fig. 5).

    Args:
        motion: one sequence, (frames, 25), without gaps.

    Returns:
        Forward to the right, along the mean heading: left blue, right orange, wrists dashed.

    Raises:
        MotionError: a batch of motions, no frames, or NaN.
    """
    poses = finite(frozen(motion.poses, (None, 25), "motion.poses"), "motion.poses")
    if not len(poses):
        raise MotionError("motion.poses has no frames: there is nothing to draw")
    sticks = _from_the_side(_sticks(poses, motion.skeleton), poses)
    points = _from_the_side(markers(poses, motion.skeleton), poses)
    wide = np.clip(np.ptp(sticks[..., 0]), 4.0, 8.0)
    figure, axes = new_figure(1, 1, (1.2 * wide + 0.8, 3.1))
    panel = axes[0, 0]
    _draw_sticks(panel, sticks, "0.75", linewidth=0.6)
    for name, style in _TRACED.items():
        for side, colour in _SIDES.items():
            x, z = points[:, MARKERS.index(f"{side}_{name}")].T
            panel.plot(x, z, style, color=colour, linewidth=1.4, label=f"{side} {name}")
    panel.set(aspect="equal", xlabel="forward [m]", ylabel="height [m]")
    figure.legend(loc="outside upper center", ncols=4, frameon=False, fontsize="small")
    return figure


def _sticks(poses: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Ends (..., sticks, 2, 3) [m] of the sticks between the markers, then from each ankle to its toes."""
    points = markers(poses, skeleton)
    toes = limb_segments(poses, skeleton)[..., _FEET, 1, :]
    feet = np.stack([points[..., _ANKLES, :], toes], axis=-2)
    return np.concatenate([points[..., np.array(EDGES), :], feet], axis=-3)


def _stick_colours() -> list[str]:
    """A colour for each of `_sticks`, by the side that it is on."""
    ends = [MARKERS[b].split("_")[0] for _, b in EDGES]
    return [_SIDES.get(side, GREY) for side in (*ends, *_SIDES)]


def _from_the_side(points: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Points (..., 3) as (way forward, height) [m] for who goes as in `poses` (..., 25): from the first, ahead."""
    heading = poses.reshape(-1, 25)[:, 5]
    ahead = np.array([np.cos(heading).mean(), np.sin(heading).mean()])
    first = poses.reshape(-1, 25)[0, :2]
    return np.stack([(points[..., :2] - first) @ (ahead / np.linalg.norm(ahead)), points[..., 2]], axis=-1)


def _draw_sticks(panel, sticks: np.ndarray, colours, *, linewidth: float = 1.0, alpha: float = 1.0) -> None:
    """Draw sticks (n, sticks, 2, 2), one figure after the other; `colours` for each stick, or one."""
    from matplotlib.collections import LineCollection

    repeated = colours if isinstance(colours, str) else list(colours) * len(sticks)
    lines = LineCollection(
        list(sticks.reshape(-1, 2, 2)), colors=repeated, linewidths=linewidth, alpha=alpha, capstyle="round"
    )
    panel.add_collection(lines)
    panel.autoscale_view()
