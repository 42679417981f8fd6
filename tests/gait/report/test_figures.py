"""The figures of a report: well-formed SVG that shows what is given."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from motionenv.gait.report.figures import COLOURS, Panel, angle_panel, path_from_above

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
    line = points(of_class(svg, "mean left")[0])
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
    line = of_class(angle_panel(panel(curve)), "mean left")[0].get("d")
    assert line.count("M") == 3
    assert len(points(ET.Element("p", d=line))) == 96
    assert "nan" not in angle_panel(panel(curve))


def test_strides_bands_and_sides():
    many = np.random.default_rng(0).normal(20, 5, (4, 101))
    band = np.stack([np.full(101, 20.0), np.full(101, 5.0)])
    svg = angle_panel(panel(many, many[:1], band=band))
    assert len(of_class(svg, "stride left")) == 4
    assert not of_class(svg, "stride right")
    assert len(of_class(svg, "toe-off left")) == len(of_class(svg, "mean right")) == 1
    assert len(of_class(svg, "band")[0].get("points").split()) == 202
    assert COLOURS.keys() == {"left", "right"}
    assert not of_class(angle_panel(panel(many, toe_off={"left": np.nan})), "stance")


def test_axes_hold_what_they_show():
    for low, high in ((-170.0, 170.0), (0.0, 0.1), (-5.0, 130.0)):
        svg = angle_panel(panel(np.linspace(low, high, 101)))
        ticks = [float(e.text) for e in of_class(svg, "number")]
        assert min(ticks) <= low
        assert max(ticks) >= high
        assert 3 <= len(ticks) <= 10
    unknown = angle_panel(panel(np.full(101, np.nan)))
    assert not of_class(unknown, "mean left")


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
