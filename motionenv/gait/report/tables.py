"""A gait report's figures as JSON and CSV."""

import csv
import io
import json
from collections.abc import Iterator, Mapping

import numpy as np

from motionenv.gait.bands import Band
from motionenv.gait.normalised import mean_and_sd
from motionenv.gait.session import Session
from motionenv.gait.trial import ANGLES

_SIDES = ("left", "right")
_COLUMNS = ("kind", "name", "side", "percent", "unit", "mean", "sd", "low", "high", "n")


def to_json(session: Session) -> str:
    """The step parameters, mean angles, band, events and stretches of a `session` as JSON; null where unknown."""
    content = {
        "person": session.person,
        "parameters": [p.to_dict() for p in session.parameters],
        "angles": {
            f"{side}_{name}": {"mean": _listed(mean), "sd": _listed(sd)}
            for side, name, mean, sd, _ in _curves(session.curves)
        },
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
                "angles": {
                    f"{side}_{name}": _listed(mean)
                    for side, name, mean, _, _ in _curves({side: t.curves(side) for side in _SIDES})
                },
                "notes": list(t.notes),
            }
            for t in session.trials
        ],
        "left_out": session.left_out,
    }
    return json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False) + "\n"


def to_csv(session: Session) -> str:
    """The step parameters and mean angles of a `session`, one figure per row; empty fields where unknown."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for p in session.parameters:
        writer.writerow(
            ["parameter", p.name, p.side, "", p.unit, *(_field(v) for v in (p.mean, p.sd, p.low, p.high)), p.n]
        )
    for side, name, mean, sd, n in _curves(session.curves):
        for percent, (m, s) in enumerate(zip(mean, sd, strict=True)):
            writer.writerow(["angle", name, side, percent, "degrees", _field(m), _field(s), "", "", n])
    return out.getvalue()


def _curves(curves: Mapping[str, np.ndarray]) -> Iterator[tuple[str, str, np.ndarray, np.ndarray, int]]:
    """Side, name, mean, standard deviation and number of strides of each angle that is known.

    `curves` are those of all strides of each side, (strides, 101, 13) [degrees].
    """
    for side in _SIDES:
        for i, name in enumerate(ANGLES):
            mean, sd = mean_and_sd(curves[side][:, :, i])
            if np.isfinite(mean).any():
                yield side, name, mean, sd, len(curves[side])


def _band(band: Band) -> dict:
    listed = lambda values: np.round(values, 2).tolist()  # as in the files of bands
    angles = {name: {"mean": listed(band.mean[name]), "sd": listed(band.sd[name])} for name in band.mean}
    return {"people": band.people, "who": band.who, "angles": angles}


def _listed(values: np.ndarray) -> list[float | None]:
    return [round(float(v), 3) if np.isfinite(v) else None for v in values]


def _field(value: float) -> str:
    return f"{value:.6g}" if np.isfinite(value) else ""
