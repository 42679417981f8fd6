"""The figures of a gait report, as SVG: joint angles over the gait cycle, their profile, and the walk from above.

Plain SVG and no plotting library: a report is written in a fraction of a second, and its figures are sharp on paper.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.runs import runs
from motionenv.gait.bands import PROFILE_ANGLES
from motionenv.gait.profile import Score
from motionenv.gait.strides import mean_and_sd

#: Colours of the sides; the report's style sheet uses the same.
COLOURS = {"left": "#b42318", "right": "#175cd3"}

WIDTH, HEIGHT = 300, 210  # [px] of one panel
LEFT, RIGHT, TOP, BOTTOM = 36, 14, 26, 32  # margins
_TICKS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)  # distances between ticks
_MOST_TICKS = 7
_PATH = 560.0  # [px] width of the view from above
_COLUMN, _TALL, _MOST = 88, 170, 30.0  # [px] of the profile's columns, and [degrees] up to which its axis goes

#: What negative and positive values of an angle mean.
_MEANS = {
    "pelvis_tilt": ("posterior", "anterior"), "pelvis_obliquity": ("down", "up"),
    "pelvis_rotation": ("external", "internal"), "hip_flexion": ("extension", "flexion"),
    "hip_adduction": ("abduction", "adduction"), "hip_rotation": ("external", "internal"),
    "knee_flexion": ("extension", "flexion"), "knee_adduction": ("valgus", "varus"),
    "knee_rotation": ("external", "internal"), "ankle_dorsiflexion": ("plantarflexion", "dorsiflexion"),
    "ankle_adduction": ("eversion", "inversion"), "ankle_rotation": ("external", "internal"),
    "foot_progression": ("external", "internal"), "trunk_tilt": ("backward", "forward"),
    "trunk_obliquity": ("down", "up"), "trunk_rotation": ("external", "internal"),
}  # fmt: skip

#: Range of each angle's axis [degrees], the same in every report, so that reports can be compared at a glance.
RANGES = {
    "pelvis_tilt": (-10, 40), "pelvis_obliquity": (-20, 20), "pelvis_rotation": (-30, 30),
    "hip_flexion": (-30, 70), "hip_adduction": (-20, 20), "hip_rotation": (-30, 30),
    "knee_flexion": (-20, 80), "knee_adduction": (-20, 20), "knee_rotation": (-30, 30),
    "ankle_dorsiflexion": (-30, 30), "ankle_adduction": (-20, 20), "ankle_rotation": (-30, 30),
    "foot_progression": (-40, 30), "trunk_tilt": (-20, 30), "trunk_obliquity": (-20, 20), "trunk_rotation": (-30, 30),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Panel:
    """Content of one panel of the figure of angles, for an angle without its side, such as "knee_flexion".

    Attributes:
        name: of the angle.
        curves, toe_off: by side, (strides, 101) [degrees] of strides that are known at least in part, and the mean
            toe-off [% of the cycle].
        band: mean and standard deviation (2, 101) [degrees] of a reference; None if it doesn't have this angle.
        sure: by side, ends (2, 101) [degrees] of the mean's band, where it is known.
    """

    name: str
    curves: Mapping[str, np.ndarray]
    toe_off: Mapping[str, float]
    band: np.ndarray | None
    sure: Mapping[str, np.ndarray] = field(default_factory=dict)


def angle_panel(panel: Panel) -> str:
    """One panel: every stride thin, means of two strides or more thick, the reference's band grey, stance shaded.

    What leaves the axis is cut off, and marked by an arrow with the value that is furthest out.
    """
    low, high = RANGES[panel.name]
    down = lambda degrees: TOP + (HEIGHT - TOP - BOTTOM) * (high - np.asarray(degrees)) / (high - low)
    percent = np.arange(101.0)
    counts = "&#160; ".join(
        f'<tspan class="{side}">{"one stride" if len(curves) == 1 else f"n = {len(curves)}"}</tspan>'
        for side, curves in panel.curves.items()
    )
    parts, drawn = [_stance(panel.toe_off), axes(panel.name, low, high, counts)], []
    if panel.band is not None:
        mean, sd = panel.band
        drawn.append(band(down(mean - sd), down(mean + sd), "band"))
        drawn.append(line(across(percent), down(mean), "reference"))
    drawn += [band(down(low), down(high), f"spread {side}") for side, (low, high) in panel.sure.items()]
    for side, curves in panel.curves.items():
        one = "single" if len(curves) == 1 else "stride"
        drawn += [line(across(percent), down(curve), f"{one} {side}") for curve in curves]
        mean = np.where(np.isfinite(curves).sum(0) > 1, mean_and_sd(curves)[0], np.nan)
        drawn.append(line(across(percent), down(mean), f"mean {side}"))
    label = f"{panel.name.replace('_', ' ')} in percent of the gait cycle"
    return framed(label, "".join(parts), "".join(drawn), _beyond(panel))


def framed(label: str, behind: str, drawn: str, before: str = "") -> str:
    """A panel of that `label`: what lies `behind`, what is `drawn` and cut off at the frame, and what is `before`."""
    box = f"{LEFT} {TOP} {WIDTH - LEFT - RIGHT} {HEIGHT - TOP - BOTTOM}"
    x, y, width, height = box.split()
    return (
        f'<svg class="panel" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(label)}">{behind}'
        f'<svg x="{x}" y="{y}" width="{width}" height="{height}" viewBox="{box}">{drawn}</svg>{before}</svg>'
    )


def across(percent: ArrayLike) -> np.ndarray:
    """Where values of `percent` of the cycle lie across a panel [px]."""
    return LEFT + (WIDTH - LEFT - RIGHT) * np.asarray(percent) / 100.0


def band(low: np.ndarray, high: np.ndarray, kind: str) -> str:
    """An area between two curves (101,) [px]."""
    percent = np.r_[0:101, 100:-1:-1]
    return f'<polygon class="{kind}" points="{points(across(percent), np.r_[high, low[::-1]])}"/>'


def profile(scores: Sequence[Score]) -> str:
    """A bar for each score up to 30 degrees, its value above, on the range and median of the reference's people."""
    totals = {"gait_profile_score": "GPS", "deviation": "all of these"}
    shown = [name for name in (*PROFILE_ANGLES, *totals) if any(score.name == name for score in scores)]
    up = lambda degrees: _TALL + 16 - _TALL * min(degrees, _MOST) / _MOST
    width = LEFT + _COLUMN * len(shown)
    parts = [f'<path class="grid" d="M{LEFT} {up(tick):.1f}H{width}"/>' for tick in (10, 20, 30)]
    parts += [f'<text class="number" x="{LEFT - 5}" y="{up(tick) + 3.5:.1f}">{tick}</text>' for tick in (0, 10, 20, 30)]
    for i, name in enumerate(shown):
        of_name = [score for score in scores if score.name == name]
        bar = (_COLUMN - 14) / max(len(of_name), 2)
        for k, score in enumerate(of_name):
            x = LEFT + _COLUMN * i + 7 + bar * k
            group = [up(v) for v in (score.high, score.low, score.median)] if np.isfinite(score.median) else []
            if group:
                height = group[1] - group[0]
                parts.append(
                    f'<rect class="band" x="{x:.1f}" y="{group[0]:.1f}" width="{bar:.1f}" height="{height:.1f}"/>'
                )
            top, kind = up(score.value), score.side or "both"
            value = f"▲{score.value:.0f}" if score.value > _MOST else f"{score.value:.1f}"
            parts.append(
                f'<rect class="bar {kind}" x="{x + 5:.1f}" y="{top:.1f}" width="{bar - 10:.1f}" '
                f'height="{_TALL + 16 - top:.1f}"/>'
            )
            if group:
                parts.append(f'<path class="median" d="M{x:.1f} {group[2]:.1f}h{bar:.1f}"/>')
            parts.append(f'<text class="percent value" x="{x + bar / 2:.1f}" y="{top - 4:.1f}">{value}</text>')
        words = totals.get(name, name.replace("_", " "))
        middle = LEFT + _COLUMN * (i + 0.5)
        parts.append(f'<text class="percent" x="{middle:.1f}" y="{_TALL + 31}">{words}</text>')
    parts.append(f'<path class="axis" d="M{LEFT} {_TALL + 16}H{width}"/>')
    return (
        f'<svg class="profile" viewBox="0 0 {width} {_TALL + 38}" style="max-width:{width}px" role="img" '
        f'aria-label="differences from the reference in degrees">{"".join(parts)}</svg>'
    )


def path_from_above(path: np.ndarray, fps: float, stretches: Sequence[tuple[float, float, str]]) -> str:
    """The pelvis' `path` (frames, 2) [m], NaN in gaps, on the floor, with a scale; only steady stretches are solid.

    `fps` is in Hz; `stretches` hold the start [s], end [s] and kind of each.
    """
    known = path[np.isfinite(path).all(-1)]
    if not len(known):
        return ""
    low, size = known.min(0), np.maximum(np.ptp(known, axis=0), 0.2)
    if size[1] > size[0]:  # the longer side lies across the page
        path, low, size = path[:, ::-1] * [1, -1], np.array([low[1], -known[:, 0].max()]), size[::-1]
    scale = (_PATH - 40) / size[0]
    height = float(size[1] * scale + 56)
    x, y = 20 + (path[:, 0] - low[0]) * scale, height - 36 - (path[:, 1] - low[1]) * scale
    parts = []
    for start, end, kind in stretches:
        at = slice(max(round(start * fps), 0), round(end * fps) + 1)
        parts.append(line(x[at], y[at], f"path {'steady' if kind == 'steady' else 'left-out'}"))
    metre = f'<path class="axis" d="M20 {height - 14:.1f}h{scale:.1f}"/>'
    text = f'<text x="{20 + scale + 6:.1f}" y="{height - 10:.1f}">1 m</text>'
    start = np.flatnonzero(np.isfinite(x))[0]
    dot = f'<circle class="start" cx="{x[start]:.1f}" cy="{y[start]:.1f}" r="4"/>'
    return (
        f'<svg class="path-view" viewBox="0 0 {_PATH:.0f} {height:.0f}" role="img" '
        f'aria-label="path of the pelvis from above">{"".join(parts)}{dot}{metre}{text}</svg>'
    )


def _beyond(panel: Panel) -> str:
    """Arrows at the upper and lower end of the axis, one below the other, with the values that are furthest out."""
    shown = {f"beyond {side}": curves for side, curves in panel.curves.items()}
    if panel.band is not None:
        mean, sd = panel.band
        shown["beyond"] = np.stack([mean - sd, mean + sd])
    low, high = RANGES[panel.name]
    ends = {kind: (np.nanmin(v), np.nanmax(v)) for kind, v in shown.items() if np.isfinite(v).any()}
    marks = lambda texts, first, step: "".join(
        f'<text class="{kind}" x="{WIDTH - RIGHT - 4}" y="{first + step * row}">{text}</text>'
        for row, (kind, text) in enumerate(texts)
    )
    above = [(kind, f"▲ {most:.0f}°") for kind, (_, most) in ends.items() if most > high]
    below = [(kind, f"▼ {least:.0f}°".replace("-", "−")) for kind, (least, _) in ends.items() if least < low]
    return marks(above, TOP + 12, 12) + marks(below, HEIGHT - BOTTOM - 5, -12)


def step_of(length: float) -> float:
    """Distance between ticks [degrees] so that an axis of `length` has a few."""
    return next((step for step in _TICKS if length / step <= _MOST_TICKS), length / _MOST_TICKS)


def axes(name: str, low: float, high: float, corner: str, before: str = "") -> str:
    """Frame, ticks and title of a panel of the angle `name` from `low` to `high` [degrees].

    With words in the `corner`, and `before` the name.
    """
    step = step_of(high - low)
    parts = []
    for tick in np.arange(np.ceil(low / step) * step, high + step / 100, step):
        y = float(TOP + (HEIGHT - TOP - BOTTOM) * (high - tick) / (high - low))
        weight = "zero" if abs(tick) < step / 100 else "grid"
        parts.append(f'<path class="{weight}" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text class="number" x="{LEFT - 5}" y="{y + 3.5:.1f}">{tick:g}</text>')
    for tick in range(0, 101, 20):
        x = float(across(tick))
        parts.append(f'<path class="axis" d="M{x:.1f} {HEIGHT - BOTTOM}v4"/>')
        parts.append(f'<text class="percent" x="{x:.1f}" y="{HEIGHT - BOTTOM + 16}">{tick}</text>')
    negative, positive = _MEANS[name]
    title = escape((before + name.replace("_", " ")).capitalize())
    parts += [
        f'<rect class="frame" x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}"/>',
        f'<text class="title" x="{LEFT}" y="16">{title} [°]</text>',
        f'<text class="sign" x="{LEFT + 4}" y="{TOP + 11}">+ {positive}</text>',
        f'<text class="sign" x="{LEFT + 4}" y="{HEIGHT - BOTTOM - 5}">− {negative}</text>',
        f'<text class="unit" x="{WIDTH - RIGHT}" y="16">{corner}</text>',
        f'<text class="unit" x="{WIDTH - RIGHT}" y="{HEIGHT - 3}">% of gait cycle</text>',
    ]
    return "".join(parts)


def _stance(toe_off: Mapping[str, float]) -> str:
    """The stance phase shaded, and a line at each side's toe-off."""
    known = {side: at for side, at in toe_off.items() if np.isfinite(at)}
    if not known:
        return ""
    width = float(across(np.mean(list(known.values())))) - LEFT
    height = HEIGHT - TOP - BOTTOM
    shade = f'<rect class="stance" x="{LEFT}" y="{TOP}" width="{width:.1f}" height="{height}"/>'
    lines = [
        f'<path class="toe-off {side}" d="M{float(across(at)):.1f} {TOP}v{height}"/>' for side, at in known.items()
    ]
    return shade + "".join(lines)


def line(x: np.ndarray, y: np.ndarray, kind: str) -> str:
    """A polyline, broken at gaps."""
    known = np.isfinite(x) & np.isfinite(y)
    lines = ["L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x[i:j], y[i:j], strict=True)) for i, j in runs(known)]
    return f'<path class="{kind}" d="M{"M".join(lines)}"/>' if lines else ""


def points(x: np.ndarray, y: np.ndarray) -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True) if np.isfinite(a) and np.isfinite(b))
