"""A report's figures as JSON and CSV, read back."""

import csv
import io
import json

import numpy as np
import pytest

from motionenv.gait import Session, Stride
from motionenv.gait.report import to_csv, to_json
from motionenv.gait.trial import ANGLES


def refuse(text):
    raise AssertionError(f"{text} is no JSON")


def test_json_holds_every_figure_and_no_nan(session):
    read = json.loads(to_json(session), parse_constant=refuse)
    assert read["person"] == session.person
    assert [(p["name"], p["side"], p["n"]) for p in read["parameters"]] == [
        (p.name, p.side, p.n) for p in session.parameters
    ]
    speed = next(p for p in read["parameters"] if p["name"] == "speed")
    own = next(p for p in session.parameters if p.name == "speed")
    assert (speed["mean"], speed["low"], speed["unit"]) == (own.mean, own.low, "m/s")
    for side in ("left", "right"):
        mean, _ = session.mean_curve(side, "hip_flexion")
        listed = read["angles"][f"{side}_hip_flexion"]["mean"]
        np.testing.assert_allclose([np.nan if v is None else v for v in listed], mean, atol=5e-4)
    assert [c["strides"] for c in read["captures"]] == [len(t.strides) for t in session.trials]
    counts = [sum(stride.side == "left" for stride in t.strides) for t in session.trials]
    knees = [c["angles"].get("left_knee_flexion", [0.0] * 101) for c in read["captures"]]
    both = np.average(np.array(knees, float), axis=0, weights=counts)  # no angle of a stride is unknown here
    np.testing.assert_allclose(both, read["angles"]["left_knee_flexion"]["mean"], atol=2e-3)
    assert [e["time"] for e in read["captures"][0]["events"]] == [e.time for e in session.trials[0].events.events]
    assert read["left_out"] == session.left_out
    assert read["band"]["people"] == session.band.people


def test_csv_holds_the_same_figures(session):
    rows = list(csv.DictReader(io.StringIO(to_csv(session))))
    parameters = [r for r in rows if r["kind"] == "parameter"]
    assert len(parameters) == len(session.parameters)
    for row, p in zip(parameters, session.parameters, strict=True):
        assert (row["name"], row["side"], row["unit"], int(row["n"])) == (p.name, p.side, p.unit, p.n)
        assert float(row["mean"]) == pytest.approx(p.mean, rel=1e-5, abs=1e-9)
        assert (row["sd"] == "") == np.isnan(p.sd)
    angles = [r for r in rows if r["kind"] == "angle"]
    assert len(angles) == 2 * len(ANGLES) * 101
    knee = [r for r in angles if (r["name"], r["side"]) == ("knee_flexion", "left")]
    assert [int(r["percent"]) for r in knee] == list(range(101))
    mean, _ = session.mean_curve("left", "knee_flexion")
    np.testing.assert_allclose([float(r["mean"] or "nan") for r in knee], mean, rtol=1e-5, atol=1e-4)


def test_unknown_figures_are_null_and_empty(session):
    walk = session.trials[0]
    one = Session((type(walk)(**{**walk.__dict__, "strides": (Stride("left", 0.7, 1.9),)}),), {})
    assert [p["sd"] for p in json.loads(to_json(one), parse_constant=refuse)["parameters"]] == [None] * 3
    assert "nan" not in to_csv(one).lower()
    assert json.loads(to_json(one))["band"] is None


def test_the_same_session_gives_the_same_text(session):
    assert to_json(session) == to_json(session)
    assert to_csv(session) == to_csv(session)
