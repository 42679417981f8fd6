"""Figures draw the data that they are given, and share no state."""

import io
import sys

import numpy as np
import pytest

from motionenv import plots
from motionenv.errors import MotionError
from motionenv.types import ANGLES

pytest.importorskip("matplotlib")

PERIODS = np.linspace(0.6, 1.6, 101)
SNR = 1 + 8 * np.exp(-(((PERIODS - 1.05) / 0.03) ** 2))


def cycle(seed=0):
    rng = np.random.default_rng(seed)
    phase = np.linspace(0, 2 * np.pi, 128, endpoint=False)
    mean = 0.4 * np.sin(phase[:, None] + rng.uniform(0, 6, 19))
    modes = 0.1 * np.sin((1 + np.arange(5))[:, None, None] * phase[:, None] + rng.uniform(0, 6, (5, 1, 19)))
    return mean, modes


def saved(figure) -> bytes:
    file = io.BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    return file.getvalue()


def test_snr_curve_draws_its_data():
    figure = plots.snr_curve(PERIODS, SNR, best=1.05)
    curve, mark = figure.axes[0].lines
    np.testing.assert_array_equal(curve.get_xydata(), np.stack([PERIODS, SNR], -1))
    assert mark.get_xdata()[0] == 1.05
    assert "[s]" in figure.axes[0].get_xlabel()


def test_components_draw_mean_plus_and_minus_each_in_degrees():
    mean, modes = cycle()
    show = ("right_knee_flexion", "left_hip_flexion")
    figure = plots.components(mean, modes, ANGLES, show=show, count=3)
    assert len(figure.axes) == 6
    for r, name in enumerate(show):
        i = ANGLES.index(name)
        for k in range(3):
            middle, plus, minus = (line.get_ydata() for line in figure.axes[3 * r + k].lines)
            np.testing.assert_allclose(middle, np.rad2deg(mean[:, i]))
            np.testing.assert_allclose(plus - middle, np.rad2deg(modes[k, :, i]), atol=1e-9)
            np.testing.assert_allclose(minus - middle, -np.rad2deg(modes[k, :, i]), atol=1e-9)
    np.testing.assert_allclose(figure.axes[0].lines[0].get_xdata(), np.arange(128) / 1.28)


def test_variance_curve_is_cumulative():
    ratios = np.array([0.5, 0.25, 0.125])
    figure = plots.variance_curve(ratios, marked=2)
    curve, mark = figure.axes[0].lines
    np.testing.assert_allclose(curve.get_xydata(), [[1, 50], [2, 75], [3, 87.5]])
    np.testing.assert_allclose(mark.get_xydata(), [[2, 75]])
    assert mark.get_label() == "2 components: 75.0 %"


def test_no_curve_leaves_its_panel():
    mean, modes = cycle()
    figure = plots.components(mean, modes, ANGLES)
    figure.draw_without_rendering()
    for panel in figure.axes:
        low, high = panel.get_ylim()
        assert all(low <= y <= high for line in panel.lines for y in line.get_ydata())


def test_same_data_same_picture_and_pyplot_stays_out():
    before = "matplotlib.pyplot" in sys.modules
    a, b = (saved(plots.components(*cycle(), ANGLES)) for _ in range(2))
    assert a == b
    assert a[:4] == b"\x89PNG"
    assert ("matplotlib.pyplot" in sys.modules) == before


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: plots.snr_curve(PERIODS, SNR[1:]), "snr must have shape"),
        (lambda: plots.components(*cycle(), ANGLES, show=("tail",)), "tail"),
        (lambda: plots.components(*cycle(), ANGLES[1:]), "mean must have shape"),
        (lambda: plots.components(cycle()[0], cycle()[1][:, :9], ANGLES), "modes must have shape"),
        (lambda: plots.components(*cycle(), ANGLES, count=0), "at least one"),
        (lambda: plots.variance_curve([]), "shares"),
        (lambda: plots.variance_curve([0.9, 0.2]), "shares"),
        (lambda: plots.variance_curve([0.9, np.nan]), "shares"),
        (lambda: plots.variance_curve([0.9, 0.05], marked=3), "1 to 2"),
    ],
)
def test_bad_input_says_what_is_wrong(call, match):
    with pytest.raises(MotionError, match=match):
        call()
