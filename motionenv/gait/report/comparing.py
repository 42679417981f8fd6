"""The page of a comparison, and its figures as JSON and CSV beside it."""

import csv
import io
import json
from html import escape
from importlib.resources import files
from pathlib import Path

import numpy as np

from motionenv import __version__
from motionenv._core.files import atomic_write
from motionenv._core.representation import counted
from motionenv.errors import MotionError
from motionenv.gait.comparison import Comparison
from motionenv.gait.effects import Effect
from motionenv.gait.report.figures import BOTTOM, HEIGHT, RANGES, TOP, across, axes, band, framed, line
from motionenv.gait.report.page import alarm

_KINDS = ("left", "right")  # colours of the first and the second curve
_PERCENT = np.arange(101.0)


def write_comparison(found: Comparison, out: str | Path) -> None:
    """Write a page, .html, of what was `found`, and beside it the same figures as .json and .csv.

    Raises:
        MotionError: `out` isn't .html or can't be written.
    """
    out = Path(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise MotionError(f"a comparison is a page: out must end in .html, got {out.name}")
    contents = {
        out: page(found), out.with_suffix(".json"): to_json(found), out.with_suffix(".csv"): to_csv(found),
    }  # fmt: skip
    for path, text in contents.items():
        with atomic_write(path) as temporary:
            Path(temporary).write_text(text, encoding="utf-8")


def page(found: Comparison) -> str:
    """The page as HTML."""
    style = files(__package__).joinpath("style.css").read_text(encoding="utf-8")
    title = f"Comparison: {escape(found.what)}"
    groups = " · ".join(f"{escape(k)}: {counted(len(who), 'person', 'people')}" for k, who in found.people.items())
    differ = [name for name, p in found.p.items() if p <= 1 - found.level]
    words = ", ".join(name.replace("_", " ") for name in differ) or "none"
    notes = "".join(f"<p>{escape(note[0].upper() + note[1:])}.</p>" for note in found.notes)
    labels = next(iter(found.curves.values()))
    key = "".join(
        f'<span class="{kind}"><i></i>{escape(label)}</span>' for kind, label in zip(_KINDS, labels, strict=False)
    )
    panels = "".join(f"<div>{_means(found, name)}{_effect(found, name)}</div>" for name in found.effects)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style></head><body>'
        f'<header><h1>{title}</h1><p class="soft">{groups}{", the same" if found.paired else ""}</p></header>'
        f'<main>{alarm(found.doubts)}{f"""<div class="notes">{notes}</div>""" if notes else ""}'
        f"<section><h2>Joint angles that differ: {words}</h2>{_table(found)}</section>"
        f'<section><h2>Over the gait cycle</h2><p class="soft">Above, means over people (± 1 SD, where there are '
        f"groups); below, the effect with the {found.level:.0%} band that holds it at all phases at once, grey where "
        f'zero lies outside.</p><p class="key">{key}</p><div class="panels">{panels}</div></section></main>'
        f"<footer>{_methods(found)}<p>Made with motionenv {__version__}.</p></footer></body></html>\n"
    )


def _means(found: Comparison, name: str) -> str:
    """The panel of the means."""
    low, high = RANGES[name]
    down = lambda degrees: TOP + (HEIGHT - TOP - BOTTOM) * (high - degrees) / (high - low)
    drawn = []
    for kind, (mean, sd) in zip(_KINDS, found.curves[name].values(), strict=False):
        if np.isfinite(sd).all():
            drawn.append(band(down(mean - sd), down(mean + sd), f"spread {kind}"))
        drawn.append(line(across(_PERCENT), down(mean), f"mean {kind}"))
    corner = f"n = {found.effects[name].people}"
    label = f"{name.replace('_', ' ')} of the groups in percent of the gait cycle"
    return framed(label, axes(name, low, high, corner), "".join(drawn))


def _effect(found: Comparison, name: str) -> str:
    """The panel of the effect."""
    effect = found.effects[name]
    reach = effect.band if np.isfinite(effect.threshold) else np.zeros(101)
    most = max(1.0, 1.05 * float(np.max(np.abs(effect.estimate) + reach)))
    down = lambda degrees: TOP + (HEIGHT - TOP - BOTTOM) * (most - degrees) / (2 * most)
    ends = [(float(across(max(a - 0.5, 0))), float(across(min(b + 0.5, 100)))) for a, b in effect.intervals]
    shades = "".join(
        f'<rect class="stance" x="{a:.1f}" y="{TOP}" width="{b - a:.1f}" height="{HEIGHT - TOP - BOTTOM}"/>'
        for a, b in ends
    )
    drawn = band(down(effect.estimate - reach), down(effect.estimate + reach), "band")
    drawn += line(across(_PERCENT), down(effect.estimate), "mean effect")
    label = f"{found.what} in {name.replace('_', ' ')} in percent of the gait cycle"
    return framed(label, shades + axes(name, -most, most, f"p {_p(found.p[name])}", "effect on "), drawn)


def _table(found: Comparison) -> str:
    rows = []
    for name, effect in found.effects.items():
        at = int(np.argmax(np.abs(effect.t)))
        reach = f" ± {effect.band[at]:.1f}" if np.isfinite(effect.threshold) else ""
        where = ", ".join(f"{a} to {b}" for a, b in effect.intervals)
        clearest = f"{effect.estimate[at]:+.1f}{reach}"
        ps = (_p(effect.p).lstrip("= "), _p(found.p[name]).lstrip("= "))
        cells = (name.replace("_", " ").capitalize(), clearest, f"{at} %", *ps, where, str(effect.people))
        rows.append(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    return (
        "<table><thead><tr><th></th><th>clearest effect [°]</th><th>at</th><th>p of the angle</th><th>p among "
        f"all</th><th>differs at [% of cycle]</th><th>people</th></tr></thead><tbody>{''.join(rows)}</tbody></table>"
    )


def _p(value: float) -> str:
    return f"= {value:.2g}" if value >= 0.001 else "&lt; 0.001"


def _methods(found: Comparison) -> str:
    how = "signs of people's differences are flipped" if found.paired else "people change places"
    ways = {len(effect.maxima) for effect in found.effects.values()}
    return (
        "<p>Each person counts once, by the mean over the strides of the steady stretches, however many there are. "
        "Least squares at each phase, with standard errors that allow for groups of unequal spread (HC2, of two groups "
        f"Welch's t). {how.capitalize()} {max(ways):,} times; the largest |t| over the cycle gives bands and p values "
        "(Freedman &amp; Lane 1983; Winkler et al. 2014). The p among all angles is how often any of them gets one as "
        "small (Westfall &amp; Young 1993).</p>"
    )


def to_json(found: Comparison) -> str:
    """The effects, their bands, and curves as JSON."""
    listed = lambda values: [round(float(v), 4) if np.isfinite(v) else None for v in values]
    one = lambda name, e: {
        "p": e.p, "p_of_all_angles": found.p[name], "people": e.people, "relabellings": len(e.maxima),
        "estimate": listed(e.estimate), "error": listed(e.error), "band": listed(e.band), "differs_at": e.intervals,
        "means": {label: listed(mean) for label, (mean, _) in found.curves[name].items()},
    }  # fmt: skip
    content = {
        "effect": found.what, "people": found.people, "paired": found.paired, "level": found.level,
        "angles": {name: one(name, effect) for name, effect in found.effects.items()},
        "notes": found.notes, "doubts": found.doubts,
    }  # fmt: skip
    return json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False) + "\n"


def to_csv(found: Comparison) -> str:
    """A row for each angle and percent of the cycle: estimate, standard error, t and the band's ends [degrees]."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("angle", "percent", "estimate", "error", "t", "low", "high"))
    for name, e in found.effects.items():
        writer.writerows([name, k, *_row(e, k)] for k in range(len(e.estimate)))
    return out.getvalue()


def _row(e: Effect, k: int) -> list[str]:
    values = (e.estimate[k], e.error[k], e.t[k], e.estimate[k] - e.band[k], e.estimate[k] + e.band[k])
    return [f"{v:.6g}" if np.isfinite(v) else "" for v in values]
