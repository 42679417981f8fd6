"""Write a gait report: the page, and its figures as JSON and CSV beside it."""

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from motionenv._core.files import atomic_write
from motionenv.errors import MotionError
from motionenv.gait.bands import Band, shipped_band
from motionenv.gait.report.figures import RANGES
from motionenv.gait.report.page import page
from motionenv.gait.session import Session, read_session
from motionenv.gait.strides import mean_and_sd
from motionenv.gait.trial import ANGLES
from motionenv.mocap import MarkerMap


def write_report(
    paths: Sequence[Path], out: Path, *, static: Path | None = None, marker_map: MarkerMap | str | None = None,
    fps: float | None = None, unit: str | float | None = None, up: str | None = None, person: str | None = None,
    wands: str = "auto", band: Band | None = None, age: float | None = None, sex: str | None = None,
    on_step: Callable[[str], None] = lambda name: None,
) -> Session:  # fmt: skip
    """Write the gait report of one person to the page `out`, .html, and beside it the same figures as .json and .csv.

    Args:
        paths, static, marker_map, fps, unit, up, person, wands, age, sex, on_step: as in
            `motionenv.gait.session.read_session`.
        out: the page.
        band: the reference to show angles against; None takes that of the people of the shipped models.

    Returns:
        What the report shows.

    Raises:
        MotionError: no file can be analysed, `age` or `sex` is out of range, or `out` isn't .html or can't be written.
    """
    out = Path(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise MotionError(f"a report is a page: out must end in .html, got {out.name}")
    reference = shipped_band() if band is None else band
    session = read_session(
        paths, static=static, marker_map=marker_map, fps=fps, unit=unit, up=up, person=person, wands=wands,
        band=reference, age=age, sex=sex, on_step=on_step,
    )  # fmt: skip
    contents = {
        out: page(session), out.with_suffix(".json"): to_json(session), out.with_suffix(".csv"): to_csv(session),
    }  # fmt: skip
    for path, text in contents.items():
        with atomic_write(path) as temporary:
            Path(temporary).write_text(text, encoding="utf-8")
    return session


_SIDES = ("left", "right")
_COLUMNS = ("kind", "name", "side", "percent", "unit", "mean", "sd", "low", "high", "n")


def to_json(session: Session) -> str:
    """The parameters, angles, profile, norms, band, events and stretches of a `session` as JSON, null if unknown."""
    content = {
        "person": session.person,
        "notes": list(session.notes),
        "parameters": [p.to_dict() for p in session.parameters],
        "angles": {
            f"{side}_{name}": {"mean": _listed(mean), "sd": _listed(sd), "n": n}
            for side, name, mean, sd, n in _curves(session.curves)
        },
        "axes": {name: list(ends) for name, ends in RANGES.items()},
        "profile": [score.to_dict() for score in session.profile],
        "norms": [norm.to_dict() for norm in session.norms],
        "band": None if session.band is None else _band(session.band),
        "captures": [
            {
                "name": t.name,
                "seconds": t.seconds,
                "fps": t.feet.fps,
                "method": t.angles.method,
                "events": [{"time": e.time, "kind": e.kind, "side": e.side} for e in t.events.events],
                "events_from": t.events.sources,
                "stretches": [{"start": s.start, "end": s.end, "kind": s.kind} for s in t.stretches],
                "strides": len(t.strides),
                "sides": {side: len(t.curves(side)) for side in _SIDES},
                "angles": {
                    f"{side}_{name}": _listed(mean)
                    for side, name, mean, _, _ in _curves({side: t.curves(side) for side in _SIDES})
                },
                "notes": list(t.notes),
                "doubts": list(t.doubts),
            }
            for t in session.trials
        ],
        "left_out": session.left_out,
    }
    return json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False) + "\n"


def to_csv(session: Session) -> str:
    """The step parameters, profile and angles of a `session`, one figure per row; empty fields where unknown."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for p in session.parameters:
        writer.writerow(
            ["parameter", p.name, p.side, "", p.unit, *(_field(v) for v in (p.mean, p.sd, p.low, p.high)), p.n]
        )
    for score in session.profile:
        writer.writerow(["profile", score.name, score.side, "", "degrees", _field(score.value), "", "", "", score.n])
    for side, name, mean, sd, n in _curves(session.curves):
        for percent, (m, s) in enumerate(zip(mean, sd, strict=True)):
            writer.writerow(["angle", name, side, percent, "degrees", _field(m), _field(s), "", "", n])
    return out.getvalue()


def _curves(curves: Mapping[str, np.ndarray]) -> Iterator[tuple[str, str, np.ndarray, np.ndarray, int]]:
    """Side, name, mean, standard deviation and number of strides, known at least in part, of each angle that is known.

    `curves` are those of all strides of each side, (strides, 101, 13) [degrees].
    """
    for side in _SIDES:
        for i, name in enumerate(ANGLES):
            mean, sd = mean_and_sd(curves[side][:, :, i])
            if np.isfinite(mean).any():
                yield side, name, mean, sd, int(np.isfinite(curves[side][:, :, i]).any(1).sum())


def _band(band: Band) -> dict:
    listed = lambda values: np.round(values, 2).tolist()  # as in the files of bands
    angles = {name: {"mean": listed(band.mean[name]), "sd": listed(band.sd[name])} for name in band.mean}
    return {"people": band.people, "who": band.who, "angles": angles}


def _listed(values: np.ndarray) -> list[float | None]:
    return [round(float(v), 3) if np.isfinite(v) else None for v in values]


def _field(value: float) -> str:
    return f"{value:.6g}" if np.isfinite(value) else ""
