"""The report of a lifted person's gait: one page, and the same figures as a table and for JSON."""

import csv
from dataclasses import asdict
from html import escape
from pathlib import Path

import numpy as np

from motionenv._core.files import atomic_write
from motionenv._core.representation import counted
from motionenv.errors import MotionError
from motionenv.gait.bands import shipped_band
from motionenv.gait.report.figures import Panel, angle_panel
from motionenv.gait.report.page import document, key, notes, parameter_table, way_from_above
from motionenv.lifting.gait import NAMES, SIDE_ANGLES, LiftedGait
from motionenv.lifting.pipeline import BAND

_SIDES = ("left", "right")
_WORDS = (
    "Mean ± standard deviation over strides; below it the 90 % interval of the mean, of which both the strides' spread "
    "and the lifting's uncertainty are parts, and the number of strides; of one stride, the lifting's alone."
)


def write_gait(found: LiftedGait, out: str | Path) -> None:
    """Write the page, .html, of what was `found` to the file `out`.

    Raises:
        MotionError: another suffix, or the file can't be written.
    """
    if Path(out).suffix.lower() not in (".html", ".htm"):
        raise MotionError(f"a report is a page: its name must end in .html, got {Path(out).name}")
    with atomic_write(out) as temporary:
        Path(temporary).write_text(gait_page(found), encoding="utf-8")


def write_angles(found: LiftedGait, out: str | Path) -> None:
    """Write `found` angles to the table `out`, .csv: a row per frame and angle, with its time and 90 % band [degrees].

    Angles that are undetermined throughout have no rows; what is cut out has empty fields.

    Raises:
        MotionError: another suffix, or the file can't be written.
    """
    if Path(out).suffix.lower() != ".csv":
        raise MotionError(f"angles are a table: its name must end in .csv, got {Path(out).name}")
    told = lambda value, digits: f"{value:.{digits}f}" if np.isfinite(value) else ""
    with atomic_write(out) as temporary, open(temporary, "w", encoding="ascii", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(("time_s", "angle", "degrees", "low", "high"))
        for name in known_angles(found):
            low, high = found.band(name)
            for k, values in enumerate(zip(found[name], low, high, strict=True)):
                rows.writerow((told(k / found.lifted.points.fps, 4), name, *(told(value, 2) for value in values)))


def known_angles(found: LiftedGait) -> list[str]:
    """Names of the angles of what was `found` that are told in some frame."""
    return [name for name in NAMES if np.isfinite(found[name]).any()]


def gait_figures(found: LiftedGait) -> dict:
    """The figures of what was `found` for JSON; what is cut out is NaN."""
    return {
        "angles": {
            name: dict(zip(("degrees", "low", "high"), (found[name], *found.band(name)), strict=True))
            for name in known_angles(found)
        },
        "events": [asdict(event) for event in found.events],
        "parameters": [p.to_dict() for p in found.parameters],
        "cut": [asdict(cut) for cut in found.cut],
        "undetermined": dict(found.undetermined), "scale": found.scale, "warnings": list(found.warnings),
    }  # fmt: skip


def gait_page(found: LiftedGait) -> str:
    """The page of what was `found` as HTML."""
    table = parameter_table(found.parameters, _WORDS)
    way = f"<section><h2>The way from above</h2>{way_from_above('', found.stretches, found.feet)}</section>"
    main = f"{_notes(found)}{_angles(found)}{table}{_events(found)}{way}"
    return document(f"Gait from film: {found.lifted.points.name or 'a walk'}", _overview(found), main, _methods())


def _overview(found: LiftedGait) -> str:
    of_both = {p.name: p for p in found.parameters if not p.side}
    parts = [f"{len(found.angles) / found.lifted.points.fps:.1f} s", counted(len(found.strides), "stride")]
    for name, digits in (("speed", 2), ("cadence", 0)):
        if name in of_both:
            p = of_both[name]
            parts.append(f"{p.mean:.{digits}f} {p.unit} ({p.low:.{digits}f} to {p.high:.{digits}f})")
    return f'<p class="soft">{" · ".join(parts)}</p>'


def _notes(found: LiftedGait) -> str:
    cut = [f"{c.start:.1f} to {c.end:.1f} s: {c.why}." for c in found.cut]
    untold: dict[str, list[str]] = {}
    for name, why in found.undetermined.items():
        untold.setdefault(why, []).append(name.replace("_", " "))
    undetermined = [f"Not told: {', '.join(names)}: {why}." for why, names in untold.items()]
    return notes([escape(line) for line in (found.scale, *found.warnings, *cut, *undetermined)])


def _angles(found: LiftedGait) -> str:
    reference = shipped_band()
    off = {p.side: p.mean for p in found.parameters if p.name == "stance"}
    panels = []
    for angle in SIDE_ANGLES:
        curves = {side: found.curves[name] for side in _SIDES if (name := f"{side}_{angle}") in found.curves}
        half = {side: found.curve_bands[f"{side}_{angle}"] for side in curves}
        sure = {side: curves[side].mean(0) + np.outer([-1.0, 1.0], half[side]) for side in curves}
        toe_off = {side: off.get(side, np.nan) for side in curves}
        if curves:
            panels.append(angle_panel(Panel(angle, curves, toe_off, reference.of(angle), sure)))
    return "" if not panels else (
        '<section><h2>Joint angles</h2><p class="soft">From initial contact to initial contact. Thin lines are '
        "strides, thick ones means of at least two. Coloured areas hold the mean with 90 % probability: strides and "
        f'lifting are uncertain.</p>{key(reference)}<div class="panels">{"".join(panels)}</div></section>'
    )  # fmt: skip


def _events(found: LiftedGait) -> str:
    rows = []
    for side in _SIDES:
        for kind, words in (("initial_contact", "initial contacts"), ("toe_off", "toe-offs")):
            times = [
                f"{e.time:.2f} ± {BAND * e.deviation:.2f}" + (f" ({e.share:.0%})" if e.share < 0.95 else "")
                for e in found.events if (e.kind, e.side) == (kind, side)
            ]  # fmt: skip
            rows.append(f"<tr><td>{side} {words}</td><td>{', '.join(times) or 'none'}</td></tr>")
    return (
        '<section><h2>Events</h2><p class="soft">Times [s] with 90 % intervals; in brackets the probability that the '
        f'foot steps there, if below 95 %.</p><table class="events">{"".join(rows)}</table></section>'
    )


def _methods() -> str:
    return (
        "<p>Lifted to 3D from the points of one camera. Angles, events and parameters are computed on the estimate and "
        "on draws from its posterior, whose spread is the lifting's uncertainty. Cardan angles in the order flexion, "
        f"adduction, rotation. Grey: {escape(shipped_band().who)}</p>"
    )
