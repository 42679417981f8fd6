"""Gait reports: page, figures, JSON and CSV."""

import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.gait import Session, Stride, read_session, read_trial, shipped_band, write_report
from motionenv.gait.report import page, to_csv, to_json
from motionenv.gait.report.figures import COLOURS, RANGES, Panel, angle_panel, path_from_above, profile
from motionenv.gait.trial import ANGLES
from motionenv.lifting.gait import SIDE_ANGLES


@pytest.fixture(scope="session")
def session(mocap) -> Session:
    """A walk with gaps, a standing trial, and a file that was left out."""
    folder = mocap / "btkdata/C3DSamples/PiG"
    walk, standing = (read_trial(folder / f"PiG_{name}.c3d") for name in ("Motion-FlatFoot-Hole", "Calibration3_FF"))
    walk = replace(walk, person="<b>Ann & “Bo”</b>", name="<script>alert(1)</script>")
    return Session((walk, standing), {"<i>.c3d": "is <empty> & broken"}, shipped_band())


WALK = "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d"


def test_three_files_with_the_same_figures(mocap, tmp_path):
    seen = []
    session = write_report([mocap / WALK], tmp_path / "a.html", on_step=seen.append)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "a.html", "a.json"]
    assert seen == ["PiG_Motion3_FF.c3d"]
    assert session.band is shipped_band()
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["captures"][0]["strides"] == 4
    write_report([mocap / WALK], tmp_path / "b.html")
    for kind in ("html", "json", "csv"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_nothing_is_written_where_nothing_can_be_analysed(mocap, tmp_path):
    with pytest.raises(MotionError, match="no file can be analysed"):
        write_report([mocap / "btkdata/TRCSamples/Empty.trc"], tmp_path / "a.html")
    with pytest.raises(MotionError, match=r"must end in .html, got a.pdf"):
        write_report([mocap / WALK], tmp_path / "a.pdf")
    assert list(tmp_path.iterdir()) == []


def test_what_stood_there_stays_if_writing_fails(mocap, tmp_path):
    (tmp_path / "a.html").mkdir()
    with pytest.raises(MotionError):
        write_report([mocap / WALK], tmp_path / "a.html")
    assert [p.name for p in tmp_path.iterdir()] == ["a.html"]


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
    told = json.loads(to_json(one), parse_constant=refuse)
    assert [p["sd"] for p in told["parameters"]] == [None] * 3
    assert "nan" not in to_csv(one).lower()
    assert told["band"] is None
    assert told["profile"] == told["norms"] == []


def cut(session: Session, left: int, right: int, **options) -> Session:
    """The walk of the session with its first strides of each side."""
    walk, kept = session.trials[0], {"left": left, "right": right}
    strides = [s for side, n in kept.items() for s in [s for s in walk.strides if s.side == side][:n]]
    trial = replace(walk, strides=tuple(sorted(strides, key=lambda s: s.start)), **options)
    return Session((trial,), {}, shipped_band())


def test_nothing_of_one_stride_is_shown_as_a_mean(session):
    one = cut(session, 1, 2)
    read = Reader(page(one))
    assert "The left side has one stride: its figures are those of this stride, and no means." in read.text
    assert "1 left stride and 2 right strides" in read.text
    for name in ("step_length", "stance"):
        of_left = next(p for p in one.parameters if (p.name, p.side) == (name, "left"))
        digits = 2 if of_left.unit == "m" else 1
        assert f"{of_left.mean:.{digits}f}one stride" in read.text
    svgs = re.findall(r'<svg class="panel".*?</svg>.*?</svg>', page(one))
    assert len(svgs) == 13
    for svg in svgs:
        assert 'class="mean left"' not in svg
        assert svg.count('class="single left"') == 1
        assert 'class="single right"' not in svg
        assert ">one stride</tspan>" in svg
        assert ">n = 2</tspan>" in svg
    told = json.loads(to_json(one))
    assert told["notes"] == list(one.notes)
    assert (told["angles"]["left_knee_flexion"]["n"], told["angles"]["right_knee_flexion"]["n"]) == (1, 2)
    assert set(told["angles"]["left_knee_flexion"]["sd"]) == {None}
    assert told["captures"][0]["sides"] == {"left": 1, "right": 2}
    assert "one stride" not in Reader(page(cut(session, 2, 2))).text


def test_a_note_on_several_captures_is_told_once(session):
    trials = tuple(replace(session.trials[0], name=name, notes=("dots jump", f"of {name}")) for name in ("one", "two"))
    text = Reader(page(replace(session, trials=trials))).text
    assert "one, two: dots jump." in text
    assert text.count("dots jump") == 1
    assert "one: of one." in text


def test_doubts_come_first(session):
    walk = session.trials[0]
    doubted = replace(session, trials=(replace(walk, doubts=("the <pelvis> is below the knees",)),))
    read = Reader(page(doubted))
    at = read.text.index("the <pelvis> is below the knees")
    assert read.text.index("Not plausible") < at < read.text.index("Joint angles")
    assert all(at < read.text.index(note) for note in walk.notes)
    assert json.loads(to_json(doubted))["captures"][0]["doubts"] == ["the <pelvis> is below the knees"]
    assert "Not plausible" not in Reader(page(session)).text


def test_the_profile_says_what_it_is_of(session):
    read = Reader(page(session))
    assert "no Gait Profile Score, and can't be compared with one" in read.text
    assert "out of 15 of both sides" in read.text
    assert "may be tilt of the pelvis" in read.text
    told = json.loads(to_json(session))["profile"]
    assert [(p["name"], p["side"], p["value"]) for p in told] == [(s.name, s.side, s.value) for s in session.profile]
    rows = [r for r in csv.DictReader(io.StringIO(to_csv(session))) if r["kind"] == "profile"]
    assert [float(r["mean"]) for r in rows] == pytest.approx([s.value for s in session.profile], rel=1e-5)
    svg = profile(session.profile)
    bars = [e for e in ET.fromstring(svg).iter() if (e.get("class") or "").startswith("bar ")]
    assert len(bars) == len(session.profile) == 4 * 2 + 3
    heights = [float(e.get("height")) for e in bars]
    wanted = [
        s.value for name in dict.fromkeys(s.name for s in session.profile) for s in session.profile if s.name == name
    ]
    np.testing.assert_allclose(np.array(heights) / heights[0], np.array(wanted) / wanted[0], rtol=0.05)
    wide = profile([replace(session.profile[0], value=44.0)])
    assert "▲44" in wide


def test_norms_stand_beside_what_was_measured(session, mocap):
    aged = replace(session, age=8, sex="female")
    read = Reader(page(aged))
    stride = next(p for p in session.parameters if (p.name, p.side) == ("stride_time", ""))
    assert "Step parameters at the age of 8" in read.text
    assert f"{stride.mean:.2f} ± {stride.sd:.2f}" in read.text
    assert "0.96 ± 0.06s" in read.text
    assert "Entropy 2013" in read.text
    assert [n["name"] for n in json.loads(to_json(aged))["norms"]] == ["stride_time"]
    assert "no norms are at hand" in replace(session, age=104).notes[0]
    assert "at the age" not in Reader(page(session)).text
    with pytest.raises(MotionError, match="sex must be"):
        read_session([mocap / WALK], age=8, sex="girl")


VOID = {"meta", "br", "link", "img", "input", "hr"}


class Reader(HTMLParser):
    """Checks that elements nest, and collects tags, attributes and text."""

    def __init__(self, text: str):
        super().__init__()
        self.open, self.tags, self.links, self.text = [], [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.links += [value for name, value in attributes if name in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1:] != ["style"]:
            self.text += data


def test_the_page_is_well_formed_and_needs_nothing_beside_it(session):
    read = Reader(page(session))
    assert read.open == []
    assert not {"script", "link", "img", "iframe"} & set(read.tags)
    assert read.links == []
    assert "url(" not in page(session)
    assert "http" not in read.text


def test_names_are_text(session):
    read = Reader(page(session))
    assert "Gait report: <b>Ann & “Bo”</b>" in read.text
    assert "<script>alert(1)</script>" in read.text
    assert "<i>.c3d was left out: is <empty> & broken" in read.text
    assert "b" not in read.tags
    assert read.tags.count("i") == page(session).count("<i></i>")  # the swatches of the legend


def test_the_page_holds_the_figures(session):
    read = Reader(page(session))
    for p in session.parameters:
        if (p.name, p.side) in (("speed", ""), ("step_length", "left"), ("step_width", "right")):
            assert f"{p.mean:.2f} ± {p.sd:.2f}" in read.text
            assert f"{p.low:.2f} to {p.high:.2f}" in read.text
    assert page(session).count('<svg class="panel"') == 13
    assert page(session).count('<svg class="path-view"') == len(session.trials)
    assert f"mean ± 1 SD of {session.band.people} people" in read.text
    assert session.band.who in read.text
    assert "nan" not in read.text.lower().split()
    assert page(session) == page(session)


def test_without_a_band_and_without_strides(mocap):
    standing = read_trial(mocap / "btkdata/C3DSamples/PiG/PiG_Calibration3_FF.c3d")
    read = Reader(page(Session((standing,), {})))
    assert read.open == []
    assert "no step parameters" in read.text
    assert "Step parameters" not in read.text
    assert "Grey band" not in read.text


PERCENT = np.arange(101)


def panel(left, right=None, **options) -> Panel:
    curves = {"left": np.atleast_2d(left)} | ({} if right is None else {"right": np.atleast_2d(right)})
    return Panel("knee_flexion", curves, options.get("toe_off", {"left": 60.0, "right": 62.0}), options.get("band"))


def of_class(svg: str, kind: str) -> list[ET.Element]:
    return [e for e in ET.fromstring(svg).iter() if e.get("class") == kind]


def points(path: ET.Element) -> np.ndarray:
    return np.array([[float(v) for v in pair.split()] for pair in re.split("[ML]", path.get("d"))[1:]])


def test_curves_are_drawn_to_scale():
    """Ticks 0 and 60 and their numbers give the scale; the curve must lie on it."""
    svg = angle_panel(panel(np.linspace(0, 60, 101)))
    numbers = {float(e.text): float(e.get("y")) - 3.5 for e in of_class(svg, "number")}
    line = points(of_class(svg, "single left")[0])
    assert len(line) == 101
    assert line[0, 1] == pytest.approx(numbers[0], abs=0.1)
    assert line[-1, 1] == pytest.approx(numbers[60], abs=0.1)
    across = {float(e.text): float(e.get("x")) for e in of_class(svg, "percent")}
    assert (line[0, 0], line[-1, 0]) == (across[0], across[100])
    shade = of_class(svg, "stance")[0]
    end = float(shade.get("x")) + float(shade.get("width"))
    assert end == pytest.approx(across[0] + 0.61 * (across[100] - across[0]), abs=0.2)


def test_lines_break_at_gaps():
    curve = np.sin(PERCENT / 10) * 20
    curve[[0, 30, 31, 32, 60]] = np.nan
    line = of_class(angle_panel(panel(curve)), "single left")[0].get("d")
    assert line.count("M") == 3
    assert len(points(ET.Element("p", d=line))) == 96
    assert "nan" not in angle_panel(panel(curve))


def test_strides_bands_and_sides():
    many = np.random.default_rng(0).normal(20, 5, (4, 101))
    band = np.stack([np.full(101, 20.0), np.full(101, 5.0)])
    svg = angle_panel(panel(many, many[:1], band=band))
    assert len(of_class(svg, "stride left")) == 4
    assert not of_class(svg, "stride right")
    assert (
        len(of_class(svg, "toe-off left")) == len(of_class(svg, "mean left")) == len(of_class(svg, "single right")) == 1
    )
    gap = many[:2].copy()
    gap[0, 40:] = np.nan
    assert len(points(of_class(angle_panel(panel(gap)), "mean left")[0])) == 40  # no mean of one stride
    assert len(of_class(svg, "band")[0].get("points").split()) == 202
    assert COLOURS.keys() == {"left", "right"}
    assert not of_class(angle_panel(panel(many, toe_off={"left": np.nan})), "stance")


def test_axes_are_the_same_whatever_they_show():
    plain = [e.text for e in of_class(angle_panel(panel(np.full(101, 20.0))), "number")]
    assert plain == ["-20", "0", "20", "40", "60", "80"]
    for low, high in ((-170.0, 170.0), (0.0, 0.1), (-5.0, 130.0)):
        assert [e.text for e in of_class(angle_panel(panel(np.linspace(low, high, 101))), "number")] == plain
    unknown = angle_panel(panel(np.full(101, np.nan)))
    assert not of_class(unknown, "single left")
    assert not of_class(unknown, "beyond left")
    assert RANGES.keys() == set(SIDE_ANGLES)


def test_what_leaves_the_axes_is_cut_off_and_marked():
    steep = np.stack([np.linspace(-170, 70, 101), np.linspace(0, 95.4, 101)])
    svg = angle_panel(panel(steep, np.full(101, 20.0), band=np.stack([np.full(101, 78.0), np.full(101, 5.0)])))
    assert [e.text for e in of_class(svg, "beyond left")] == ["▲ 95°", "▼ −170°"]
    assert not of_class(svg, "beyond right")
    assert [e.text for e in of_class(svg, "beyond")] == ["▲ 83°"]
    inner = next(e for e in ET.fromstring(svg) if e.tag == "svg")
    assert len([e for e in inner if e.get("class") == "stride left"]) == 2
    frame = of_class(svg, "frame")[0]
    assert [inner.get(k) for k in ("x", "y", "width", "height")] == [
        frame.get(k) for k in ("x", "y", "width", "height")
    ]
    assert inner.get("viewBox") == " ".join(frame.get(k) for k in ("x", "y", "width", "height"))


@pytest.mark.parametrize("along", [0, 1])
def test_the_path_from_above(along):
    """Four metres, drawn across the page whichever way the laboratory lies; a scale of one metre."""
    path = np.zeros((401, 2))
    path[:, along] = np.linspace(1, 5, 401)
    path[200:210] = np.nan
    svg = path_from_above(path, 100.0, [(0, 1.0, "standing"), (1.0, 4.01, "steady")])
    steady = of_class(svg, "path steady")[0].get("d")
    assert steady.count("M") == 2
    line = points(ET.Element("p", d=steady))
    metre = float(re.search(r"h([\d.]+)", of_class(svg, "axis")[0].get("d"))[1])
    assert np.ptp(line[:, 0]) == pytest.approx(3 * metre, abs=0.3)
    assert np.ptp(line[:, 1]) < 0.2
    assert len(of_class(svg, "path left-out")) == 1
    assert path_from_above(np.full((9, 2), np.nan), 100.0, []) == ""


def test_left_is_left_of_the_way():
    """Seen from above, a path that turns left bends to the left of its direction, not mirrored."""
    for swap in (False, True):
        x = np.linspace(0, 4, 50)
        path = np.stack([x, 0.05 * x**2], -1)
        path = path @ np.array([[0, 1], [-1, 0]]) if swap else path
        line = points(of_class(path_from_above(path, 10.0, [(0, 5, "steady")]), "path steady")[0]) * [1, -1]
        a, b = line[25] - line[0], line[-1] - line[25]
        assert a[0] * b[1] - a[1] * b[0] > 0
