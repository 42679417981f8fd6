"""The README's figures, drawn after those of the papers: stick figures, ways of hands and feet, what models learned."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.body import EDGES, LIMBS, limb_segments, markers
from motionenv.lifting.plot import BLUE, GREY, ORANGE, new_figure
from motionenv.types import MARKERS, Motion, Skeleton

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GREEN = "#009e73"
_SIDES = {"left": BLUE, "right": ORANGE}
_ANKLES = [MARKERS.index(f"{side}_ankle") for side in _SIDES]
_FEET = [LIMBS.index(f"{side}_foot") for side in _SIDES]
_TRACED = {"wrist": "--", "ankle": "-"}  # whose ways are drawn, and how
#: Sign of a component, colour, line style and legend of the curves of `components`.
_SHIFTS = (
    (0, GREY, "-", "mean"),
    (1, BLUE, "-", "mean + component"),
    (-1, ORANGE, "--", "mean - component"),
)


def pose_samples(probe, samples, skeleton: Skeleton, titles) -> "Figure":
    """Poses that may come next, over each other and seen from the side (paper C, fig. 3).

    Args:
        probe: (25,) [m, rad], the last pose before them.
        samples: (panels, n, 25) [m, rad], n draws in each panel, for instance at one temperature each.
        skeleton: the body.
        titles: one for each panel.

    Returns:
        Stick figures, forward to the right: the probe black, draws with left limbs blue and right limbs orange.
    """
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
    """
    poses = motion.poses
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
    """
    modes = modes[:count]
    percent = np.arange(len(mean)) * 100 / len(mean)
    figure, axes = new_figure(len(show), len(modes), (2.2 * len(modes) + 0.6, 2.0 * len(show) + 0.6))
    for row, name in zip(axes, show, strict=True):
        i = channels.index(name)
        for k, panel in enumerate(row):
            for shift, colour, style, label in _SHIFTS:
                angles = np.rad2deg(mean[:, i] + shift * modes[k, :, i])
                panel.plot(percent, angles, style, color=colour, linewidth=1.2, label=label)
            panel.set(xlim=(0, 100))
        row[0].set_ylabel(f"{name.replace('_', ' ')} [°]")
    for k, panel in enumerate(axes[0], 1):
        panel.set_title(f"component {k}", fontsize="medium")
    for panel in axes[-1]:
        panel.set_xlabel("cycle [%]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False, fontsize="small")
    return figure


def variance_curve(ratios, *, marked: int | None = None) -> "Figure":
    """Cumulative share of the variance that the components cover (paper B, fig. 2).

    Args:
        ratios: (n,) share of each component, largest first, from 0 to 1.
        marked: a number of components to mark, with its share (paper B: 30 components, 95.5 %).
    """
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
    """
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


def frame_and_truth(frame, pixels) -> "Figure":
    """A rendered frame beside what is known of it.

    Args:
        frame: of `motionenv.render.render`, of one pose.
        pixels: (15, 2), where the markers are in it.

    Returns:
        Colour with the markers on it, depth [m], and the limb that each pixel shows.
    """
    figure, ((colour, depth, limbs),) = new_figure(1, 3, (8, 3.8))
    colour.imshow(frame.rgb)
    colour.plot(*pixels.T, "o", color="white", markeredgecolor="black", markersize=4)
    colour.set_title("colour and markers")
    body = np.isfinite(frame.depth) & (frame.limbs > 0)
    shown = depth.imshow(np.where(body, frame.depth, np.nan), cmap="viridis_r")
    figure.colorbar(shown, ax=depth, shrink=0.8)
    depth.set_title("depth [m]")
    limbs.imshow(np.where(body, frame.limbs, np.nan), cmap="tab20", interpolation="nearest")
    limbs.set_title("limbs")
    for panel in (colour, depth, limbs):
        panel.set_axis_off()
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
