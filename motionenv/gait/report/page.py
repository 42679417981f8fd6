"""The page of a gait report: one HTML file that needs nothing beside it, on screen and on paper."""

from collections import defaultdict
from collections.abc import Sequence
from html import escape
from importlib.resources import files

import numpy as np

from motionenv import __version__
from motionenv.gait.bands import Band
from motionenv.gait.feet import Feet
from motionenv.gait.norms import Norm
from motionenv.gait.report.figures import Panel, angle_panel, path_from_above, profile
from motionenv.gait.session import Session
from motionenv.gait.stretches import Stretch
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
    doubts = [f"{trial.name}: {doubt}" for trial in session.trials for doubt in trial.doubts]
    table = parameter_table(
        session.parameters,
        "Mean ± standard deviation over strides; below it the 95 % interval of the mean and the number of strides.",
    )
    return document(
        f"Gait report: {session.person}", _overview(session),
        f"{alarm(doubts)}{_notes(session)}{_angles(session)}{_profile(session)}{table}{_norms(session)}"
        f"<section><h2>Captures</h2>{''.join(map(_trial, session.trials))}</section>",
        _methods(session),
    )  # fmt: skip


def document(title: str, overview: str, main: str, methods: str) -> str:
    """A page of that `title`, in words, and of the HTML below the title, in the middle and at the end."""
    style = files(__package__).joinpath("style.css").read_text(encoding="utf-8")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style></head><body>'
        f"<header><h1>{escape(title)}</h1>{overview}</header><main>{main}</main>"
        f"<footer>{methods}<p>Made with motionenv {__version__}.</p></footer></body></html>\n"
    )


def _overview(session: Session) -> str:
    counts = {side: sum(s.side == side for s in session.strides) for side in ("left", "right")}
    seconds = sum(t.seconds for t in session.trials)
    parts = [
        f"{_count(len(session.trials), 'capture')}, {seconds:.1f} s",
        " and ".join(_count(n, f"{side} stride") for side, n in counts.items()),
    ]
    for name, digits in (("speed", 2), ("cadence", 0)):
        parts += [
            f"{p.mean:.{digits}f} {p.unit}{' (one stride)' if p.n == 1 else ''}"
            for p in session.parameters if p.name == name
        ]  # fmt: skip
    return f'<p class="soft">{" · ".join(parts)}</p>'


def alarm(doubts: Sequence[str]) -> str:
    """A box of what isn't plausible; nothing without `doubts`."""
    head = "<p><strong>Not plausible, so doubt the figures below:</strong></p>"
    texts = "".join(f"<p>{escape(doubt)}.</p>" for doubt in doubts)
    return f'<div class="doubts" role="alert">{head}{texts}</div>' if doubts else ""


def _notes(session: Session) -> str:
    found = [f"{escape(note[0].upper() + note[1:])}." for note in session.notes]
    for note in dict.fromkeys(note for trial in session.trials for note in trial.notes):
        found.append(f"{escape(', '.join(t.name for t in session.trials if note in t.notes))}: {escape(note)}.")
    found += [f"{escape(name)} was left out: {escape(why)}" for name, why in session.left_out.items()]
    return notes(found)


def notes(lines: Sequence[str]) -> str:
    """A box of `lines` of HTML; nothing without any."""
    return f'<div class="notes">{"".join(f"<p>{line}</p>" for line in lines)}</div>' if lines else ""


def _angles(session: Session) -> str:
    panels = [angle_panel(panel) for panel in _panels(session)]
    if not panels:
        return ""
    return (
        '<section><h2>Joint angles</h2><p class="soft">From initial contact to initial contact. Thin lines are '
        "strides, thick ones means of at least two, dashed ones toe-off; n counts strides. The axes are the same in "
        f"every report: an arrow tells how far something leaves them.</p>{key(session.band)}"
        f'<div class="panels">{"".join(panels)}</div></section>'
    )


def key(band: Band | None) -> str:
    """What the colours of angles' panels mean."""
    swatches = [("left", "left"), ("right", "right"), ("stance", "stance")]
    if band is not None:
        swatches.append(("band", f"mean ± 1 SD of {band.people} people"))
    spans = "".join(f'<span class="{kind}"><i></i>{text}</span>' for kind, text in swatches)
    return f'<p class="key">{spans}</p>'


def _panels(session: Session) -> list[Panel]:
    """A panel for each angle that is known."""
    found = []
    for i, name in enumerate(ANGLES):
        curves = {
            side: of_side[known, :, i]
            for side, of_side in session.curves.items()
            if (known := np.isfinite(of_side[:, :, i]).any(1)).any()
        }
        if curves:
            toe_off = {side: session.toe_off(side) for side in curves}
            found.append(Panel(name, curves, toe_off, session.band.of(name) if session.band else None))
    return found


def _profile(session: Session) -> str:
    """The movement analysis profile, with what it is of, and what stands in the way of a gait profile score."""
    scores, band = session.profile, session.band
    if band is None or not scores:
        return ""
    counts = {side: [s.n for s in scores if s.side == side and s.angles == 1] for side in ("left", "right")}
    strides = " and ".join(f"{_count(max(n), f'{side} stride')}" for side, n in counts.items() if n)
    lines = [
        f"Root mean square difference from the mean of {band.people} people over the gait cycle [°], of {strides}."
    ]
    if any(np.isfinite(score.median) for score in scores):
        lines.append("Grey: range and median of these people, each against the mean of the others.")
    whole = [score for score in scores if score.angles > 1]
    if any(score.name == "deviation" for score in whole):
        most = max(score.angles for score in whole)
        of = "15 of both sides" if any(not score.side for score in whole) else "9 of a side"
        lines.append(
            f"The last bars are of the {most} angles that are known here and in the reference, out of {of}: they are "
            "no Gait Profile Score, and can't be compared with one."
        )
    else:
        lines.append("GPS is the Gait Profile Score of each side and of both together.")
    pelvis = ANGLES.index("pelvis_tilt")
    if "pelvis_tilt" not in band.mean and any(np.isfinite(c[:, :, pelvis]).any() for c in session.curves.values()):
        lines.append(
            "The reference doesn't know the pelvis: its hip angles are those to the trunk, so much of the hip's "
            "difference may be tilt of the pelvis."
        )
    return (
        f'<section><h2>Movement Analysis Profile</h2><p class="soft">{" ".join(lines)}</p>{profile(scores)}</section>'
    )


def _norms(session: Session) -> str:
    """The step parameters beside published norms for the person's age."""
    if not session.norms:
        return ""
    own = {p.name: p for p in session.parameters if not p.side}
    rows = "".join(_norm(norm, own[norm.name]) for norm in session.norms)
    return (
        f'<section><h2>Step parameters at the age of {session.age:g}</h2><p class="soft">Norms are of healthy people '
        "who walk over ground at a comfortable speed: mean over people, ± standard deviation if it was published. A "
        "mean alone doesn't tell how much people differ.</p>"
        '<table class="norms"><thead><tr><th></th><th>measured</th><th>norm</th><th>unit</th><th>people</th>'
        f"<th>source</th></tr></thead><tbody>{rows}</tbody></table></section>"
    )


def _norm(norm: Norm, own: Parameter) -> str:
    who = f"{ {'female': 'women', 'male': 'men', '': 'both sexes'}[norm.sex] }, {norm.youngest} to {norm.oldest} years"
    text = f"{norm.mean:.2f}" + ("" if norm.sd is None else f" ± {norm.sd:.2f}")
    cells = (norm.name.replace("_", " ").capitalize(), _figures(own), text, norm.unit, who, norm.source)
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def parameter_table(parameters: Sequence[Parameter], words: str) -> str:
    """The table of step parameters, below `words` on what is in its cells."""
    by_name: dict[str, dict[str, Parameter]] = defaultdict(dict)
    for parameter in parameters:
        by_name[parameter.name][parameter.side] = parameter
    body = []
    for heading, names in _ROWS.items():
        rows = [_row(name, by_name[name]) for name in names if by_name[name]]
        body += [f'<tr><th colspan="5">{heading}</th></tr>', *rows] if rows else []
    if not body:
        return ""
    return (
        f'<section><h2>Step parameters</h2><p class="soft">{words}</p>'
        "<table><thead><tr><th></th><th>left</th><th>right</th>"
        f"<th>both</th><th>unit</th></tr></thead><tbody>{''.join(body)}</tbody></table></section>"
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
    below = [f"{parameter.low:.{digits}f} to {parameter.high:.{digits}f}"] if np.isfinite(parameter.low) else []
    below.append("one stride" if parameter.n == 1 else f"n = {parameter.n}")
    return f"{text}<br><small>{', '.join(below)}</small>"


def _trial(trial: Trial) -> str:
    events = ", ".join(f"{n} {_SOURCES[source]}" for source, n in trial.events.sources.items()) or "none"
    text = (
        f"<h3>{escape(trial.name)}</h3><p>{trial.seconds:.2f} s at {trial.feet.fps:g} frames per second, "
        f"{_count(len(trial.strides), 'stride')}</p><p>Events: {events}</p>"
    )
    return way_from_above(text, trial.stretches, trial.feet)


def way_from_above(text: str, stretches: Sequence[Stretch], feet: Feet) -> str:
    """HTML `text`, the stretches that were used, and the way from above."""
    picture = path_from_above(feet.pelvis[:, :2], feet.fps, [(s.start, s.end, s.kind) for s in stretches])
    used = "".join(
        f"<li>{s.start:.1f} to {s.end:.1f} s: {s.kind}{'' if s.kind == 'steady' else ' (left out)'}</li>"
        for s in stretches
    )
    return f'<div class="trial"><div>{text}<ul>{used}</ul></div>{picture}</div>'


def _methods(session: Session) -> str:
    ways = sorted({trial.angles.method for trial in session.trials})
    lines = [
        f"<p>Joint angles: {escape(way)}. Cardan angles in the order flexion, adduction, rotation.</p>" for way in ways
    ]
    if session.band is not None:
        lines.append(f"<p>Grey band: {escape(session.band.who)}</p>")
        lines.append(
            "<p>Movement Analysis Profile and Gait Profile Score: Baker et al. 2009, each stride against the "
            "reference's mean, then the mean over strides; a side's score is over its nine angles, that of both over "
            "fifteen, with the pelvis over left strides. The least difference of a Gait Profile Score that matters in "
            "the clinic is 1.6° (Baker et al. 2012).</p>"
        )
    lines.append(
        "<p>Step lengths and widths are measured along the line of each stride (Huxham et al. 2006). Intervals are t "
        "intervals over strides, which depend on each other: over several sessions they would be wider.</p>"
    )
    return "".join(lines)


def _count(n: int, one: str) -> str:
    return f"{n} {one if n == 1 else one + 's'}"
