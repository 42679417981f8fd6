"""The page of a gait report: one HTML file that needs nothing beside it, on screen and on paper."""

from collections import defaultdict
from html import escape
from importlib.resources import files

import numpy as np

from motionenv import __version__
from motionenv.gait.report.figures import Panel, angle_panel, path_from_above
from motionenv.gait.session import Session
from motionenv.gait.summary import Parameter
from motionenv.gait.trial import ANGLES, Trial

#: Headings of the table of step parameters, and the parameters under each.
_ROWS = {
    "Pace": ("speed", "cadence", "walk_ratio", "dimensionless_speed"),
    "Distances": ("stride_length", "step_length", "step_width"),
    "Times": ("stride_time", "step_time", "stance", "swing", "single_support", "double_support"),
    "Symmetry, left above right": ("step_length_symmetry", "step_time_symmetry", "stance_symmetry"),
    "Variability": ("stride_time_cv", "stride_length_cv", "step_width_cv"),
}
_DECIMALS = {"m/(steps/min)": 5, "%": 1, "steps/min": 1, "": 3}
_SOURCES = {"file": "marked in the file", "plates": "from force plates", "kinematics": "from the paths of the feet"}


def page(session: Session) -> str:
    """The report of a `session` as HTML."""
    style = files(__package__).joinpath("style.css").read_text(encoding="utf-8")
    title = f"Gait report: {escape(session.person)}"
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style></head><body>'
        f"<header><h1>{title}</h1>{_overview(session)}</header>"
        f"<main>{_notes(session)}{_angles(session)}{_table(session)}"
        f"<section><h2>Captures</h2>{''.join(map(_trial, session.trials))}</section></main>"
        f"<footer>{_methods(session)}<p>Made with motionenv {__version__}.</p></footer></body></html>\n"
    )


def _overview(session: Session) -> str:
    counts = {side: sum(s.side == side for s in session.strides) for side in ("left", "right")}
    seconds = sum(t.seconds for t in session.trials)
    parts = [
        f"{_count(len(session.trials), 'capture')}, {seconds:.1f} s",
        f"{counts['left']} left and {counts['right']} right strides",
    ]
    parts += [f"{p.mean:.2f} {p.unit}" for p in session.parameters if p.name == "speed"]
    parts += [f"{p.mean:.0f} {p.unit}" for p in session.parameters if p.name == "cadence"]
    return f'<p class="soft">{" · ".join(parts)}</p>'


def _notes(session: Session) -> str:
    notes = [f"{escape(t.name)}: {escape(note)}." for t in session.trials for note in t.notes]
    notes += [f"{escape(name)} was left out: {escape(why)}" for name, why in session.left_out.items()]
    return f'<div class="notes">{"".join(f"<p>{note}</p>" for note in notes)}</div>' if notes else ""


def _angles(session: Session) -> str:
    panels = [angle_panel(panel) for panel in _panels(session)]
    if not panels:
        return ""
    return (
        '<section><h2>Joint angles</h2><p class="soft">From initial contact to initial contact. Thin lines are '
        f"strides, dashed lines toe-off.</p>{_key(session)}"
        f'<div class="panels">{"".join(panels)}</div></section>'
    )


def _key(session: Session) -> str:
    swatches = [("left", "left"), ("right", "right"), ("stance", "stance")]
    if session.band is not None:
        swatches.append(("band", f"mean ± 1 SD of {session.band.people} people"))
    spans = "".join(f'<span class="{kind}"><i></i>{text}</span>' for kind, text in swatches)
    return f'<p class="key">{spans}</p>'


def _panels(session: Session) -> list[Panel]:
    """A panel for each angle that is known."""
    found = []
    for i, name in enumerate(ANGLES):
        curves = {
            side: of_side[:, :, i] for side, of_side in session.curves.items() if np.isfinite(of_side[:, :, i]).any()
        }
        if curves:
            toe_off = {side: session.toe_off(side) for side in curves}
            found.append(Panel(name, curves, toe_off, session.band.of(name) if session.band else None))
    return found


def _table(session: Session) -> str:
    by_name: dict[str, dict[str, Parameter]] = defaultdict(dict)
    for parameter in session.parameters:
        by_name[parameter.name][parameter.side] = parameter
    body = []
    for heading, names in _ROWS.items():
        rows = [_row(name, by_name[name]) for name in names if by_name[name]]
        body += [f'<tr><th colspan="5">{heading}</th></tr>', *rows] if rows else []
    if not body:
        return ""
    return (
        '<section><h2>Step parameters</h2><p class="soft">Mean ± standard deviation over strides; below it the 95 % '
        "interval of the mean.</p><table><thead><tr><th></th><th>left</th><th>right</th><th>both</th><th>unit</th></tr>"
        f"</thead><tbody>{''.join(body)}</tbody></table></section>"
    )


def _row(name: str, sides: dict[str, Parameter]) -> str:
    unit = next(iter(sides.values())).unit
    label = name.removesuffix("_symmetry").removesuffix("_cv").replace("_", " ").capitalize()
    label += ", coefficient of variation" if name.endswith("_cv") else ""
    cells = "".join(
        f"<td>{_figures(sides[side])}</td>" if side in sides else "<td></td>" for side in ("left", "right", "")
    )
    return f"<tr><td>{label}</td>{cells}<td>{escape(unit)}</td></tr>"


def _figures(parameter: Parameter) -> str:
    digits = _DECIMALS.get(parameter.unit, 2)
    text = f"{parameter.mean:.{digits}f}"
    if np.isfinite(parameter.sd):
        text += f" ± {parameter.sd:.{digits}f}"
    if np.isfinite(parameter.low):
        text += f"<br><small>{parameter.low:.{digits}f} to {parameter.high:.{digits}f}</small>"
    return text


def _trial(trial: Trial) -> str:
    picture = path_from_above(
        trial.feet.pelvis[:, :2], trial.feet.fps, [(s.start, s.end, s.kind) for s in trial.stretches]
    )
    used = "".join(
        f"<li>{s.start:.1f} to {s.end:.1f} s: {s.kind}{'' if s.kind == 'steady' else ' (left out)'}</li>"
        for s in trial.stretches
    )
    events = ", ".join(f"{n} {_SOURCES[source]}" for source, n in trial.events.sources.items()) or "none"
    text = (
        f"<div><h3>{escape(trial.name)}</h3><p>{trial.seconds:.2f} s at {trial.feet.fps:g} frames per second, "
        f"{_count(len(trial.strides), 'stride')}</p><p>Events: {events}</p><ul>{used}</ul></div>"
    )
    return f'<div class="trial">{text}{picture}</div>'


def _methods(session: Session) -> str:
    ways = sorted({trial.angles.method for trial in session.trials})
    lines = [
        f"<p>Joint angles: {escape(way)}. Cardan angles in the order flexion, adduction, rotation.</p>" for way in ways
    ]
    if session.band is not None:
        lines.append(f"<p>Grey band: {escape(session.band.who)}</p>")
    lines.append(
        "<p>Step lengths and widths are measured along the line of each stride (Huxham et al. 2006). Intervals are t "
        "intervals over strides, which depend on each other: over several sessions they would be wider.</p>"
    )
    return "".join(lines)


def _count(n: int, one: str) -> str:
    return f"{n} {one if n == 1 else one + 's'}"
