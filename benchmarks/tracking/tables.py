"""Summaries of episodes as table rows: shares and means with 95 % intervals."""

from typing import Any

import numpy as np

LAST = 10  # final frames that decide whether a track was kept
BEFORE = slice(10, 20)  # frames before the occlusion, when the given start no longer matters
AFTER = slice(-20, None)
_Z = 1.96
_DRAWS = 4000
COLUMNS = ("kept", "every limb", "absolute [mm]", "relative [mm]", "coverage")


def row(name: str, played: list[dict[str, Any]]) -> dict[str, Any]:
    """Results of a row: [mean, low, high] each, and the median of frames per second.

    Args:
        name: name of the row.
        played: results of `benchmarks.tracking.episode.play`.
    """
    last = np.array([one["limbs"][-LAST:].mean(axis=0) for one in played])
    before = np.array([one["absolute"][BEFORE].mean() for one in played])
    after = np.array([one["absolute"][AFTER].mean() for one in played])
    return {
        "name": name,
        "kept": share(last.mean(axis=1) < 0.5),
        "every limb": share(last.max(axis=1) < 0.5),
        "absolute [mm]": mean([1e3 * one["absolute"].mean() for one in played]),
        "relative [mm]": mean([1e3 * one["relative"].mean() for one in played]),
        "coverage": mean([(one["levels"] < 0.9).mean() for one in played]),
        "after / before": ratio(after, before),
        "frames/s": float(1 / np.median([one["seconds"] for one in played])),
        "episodes": [
            {"trial": one["trial"], "absolute": one["absolute"].tolist(), "relative": one["relative"].tolist(),
             "limbs": last_of.tolist(), "levels": np.asarray(one["levels"]).tolist()}
            for one, last_of in zip(played, last, strict=True)
        ],
    }  # fmt: skip


def share(yes: np.ndarray) -> list[float]:
    """Share of `yes` (n,) and its interval (Wilson 1927)."""
    n, p = len(yes), float(np.mean(yes))
    middle = (p + _Z**2 / (2 * n)) / (1 + _Z**2 / n)
    half = _Z * np.sqrt(p * (1 - p) / n + _Z**2 / (4 * n**2)) / (1 + _Z**2 / n)
    return [p, max(0.0, float(middle - half)), min(1.0, float(middle + half))]


def mean(values) -> list[float]:
    """Mean of `values` (n,) and its interval."""
    values = np.asarray(values)
    return _with_interval(values.mean(), values[_draws(len(values))].mean(axis=1))


def median(values) -> list[float]:
    """Median of `values` (n,) and its interval."""
    values = np.asarray(values)
    return _with_interval(np.median(values), np.median(values[_draws(len(values))], axis=1))


def cell(found: list[float], form: str) -> str:
    """A value and its interval, each formatted by `form`."""
    value, low, high = (form.format(x) for x in found)
    return f"{value} ({low}–{high})"


def ratio(above: np.ndarray, below: np.ndarray) -> list[float]:
    """Ratio of the means of `above` and `below`, (n,) each and paired by episode, and its interval."""
    which = _draws(len(above))
    return _with_interval(above.mean() / below.mean(), above[which].mean(axis=1) / below[which].mean(axis=1))


def _draws(n: int) -> np.ndarray:
    return np.random.default_rng(0).integers(n, size=(_DRAWS, n))


def _with_interval(value: float, drawn: np.ndarray) -> list[float]:
    return [float(value), *map(float, np.percentile(drawn, (2.5, 97.5)))]


def head(columns: tuple[str, ...]) -> str:
    """The header of a Markdown table with some columns and the frames per second."""
    return f"| tracker | {' | '.join(columns)} | frames/s |\n{'|-' * (len(columns) + 2)}|"


def line(found: dict[str, Any], columns: tuple[str, ...]) -> str:
    """A row of the Markdown table.

    Args:
        found: result of `row`.
        columns: the columns given to `head`.
    """
    forms = {"kept": "{:.0%}", "every limb": "{:.0%}", "coverage": "{:.0%}", "after / before": "{:.2f}"}
    cells = []
    for key in columns:
        value, low, high = (forms.get(key, "{:.0f}").format(x) for x in found[key])
        cells.append(f"{value} ({low}–{high})")
    return f"| {found['name']} | {' | '.join(cells)} | {found['frames/s']:,.0f} |"
