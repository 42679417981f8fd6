"""Figures draw the data that they are given, and share no state."""

import io
import sys

import numpy as np
import pytest

from benchmarks.lifting import figures
from motionenv.body import from_height, markers
from motionenv.types import ANGLES, MARKERS, Motion
from renders import plotting

pytest.importorskip("matplotlib")


def cycle(seed=0):
    rng = np.random.default_rng(seed)
    phase = np.linspace(0, 2 * np.pi, 128, endpoint=False)
    mean = 0.4 * np.sin(phase[:, None] + rng.uniform(0, 6, 19))
    modes = 0.1 * np.sin((1 + np.arange(5))[:, None, None] * phase[:, None] + rng.uniform(0, 6, (5, 1, 19)))
    return mean, modes


BODY = from_height(1.75)


def walk(frames=40) -> Motion:
    """Straight on for 1 m/s, heading 50° to the left of x."""
    poses = np.zeros((frames, 25))
    way = np.arange(frames) / 30
    poses[:, 0], poses[:, 1], poses[:, 2], poses[:, 5] = way * np.cos(0.87), way * np.sin(0.87), 0.93, 0.87
    poses[:, 17], poses[:, 21] = 0.4 * np.sin(6 * way), -0.4 * np.sin(6 * way)
    return Motion(poses, BODY, 30)


def draws(n=1000, b=16, seed=0):
    rng = np.random.default_rng(seed)
    return {"tree": rng.normal(size=(n, b)), "exact": 0.3 + 0.5 * rng.normal(size=(n, b))}


def saved(figure) -> bytes:
    file = io.BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    return file.getvalue()


def test_components_draw_mean_plus_and_minus_each_in_degrees():
    mean, modes = cycle()
    show = ("right_knee_flexion", "left_hip_flexion")
    figure = plotting.components(mean, modes, ANGLES, show=show, count=3)
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
    figure = plotting.variance_curve(ratios, marked=2)
    curve, mark = figure.axes[0].lines
    np.testing.assert_allclose(curve.get_xydata(), [[1, 50], [2, 75], [3, 87.5]])
    np.testing.assert_allclose(mark.get_xydata(), [[2, 75]])
    assert mark.get_label() == "2 components: 75.0 %"


def test_pose_samples_draw_each_pose_and_the_probe_black_over_them():
    probe = walk().poses[20]
    samples = probe + 0.1 * np.random.default_rng(0).normal(size=(3, 10, 25)) * (np.arange(25) > 5)
    figure = plotting.pose_samples(probe, samples, BODY, ["cold", "warm", "hot"])
    assert [panel.get_title() for panel in figure.axes] == ["cold", "warm", "hot"]
    for panel, poses in zip(figure.axes, samples, strict=True):
        drawn, own = (np.array(lines.get_segments()) for lines in panel.collections)
        assert len(drawn) == 10 * len(own)
        points = markers(poses, BODY)
        head = drawn[:: len(own), 0]  # the first stick goes from the head down
        forward = (points[:, 0, :2] - probe[:2]) @ [np.cos(probe[5]), np.sin(probe[5])]
        np.testing.assert_allclose(head, np.stack([forward, points[:, 0, 2]], -1), atol=1e-12)
        np.testing.assert_array_equal(panel.collections[1].get_colors(), [[0, 0, 0, 1]])


def test_sides_have_their_colours():
    """A figure whose left side is all that was moved differs from the probe's in blue sticks only."""
    probe = walk().poses[20]
    moved = probe.copy()
    moved[[9, 12, 17, 20]] += 0.3
    (panel,) = plotting.pose_samples(probe, moved[None, None], BODY, [""]).axes
    drawn, own = (np.array(lines.get_segments()) for lines in panel.collections)
    colours = panel.collections[0].get_colors()[:, :3]
    differ = np.abs(drawn - own).max((1, 2)) > 1e-9
    blue = colours[:, 2] > colours[:, 0] + 0.2
    assert differ.sum() == 5  # upper arm, forearm, thigh, shin, foot
    assert blue[differ].all()


def test_coefficient_histograms_are_densities_beside_the_gaussian():
    drawn, probe = draws(), np.linspace(-1, 1, 16)
    figure = plotting.coefficient_histograms(drawn, probe, 0.25, show=(3, 16))
    assert [panel.get_xlabel() for panel in figure.axes] == ["coefficient 3 [σ]", "coefficient 16 [σ]"]
    for panel, k in zip(figure.axes, (3, 16), strict=True):
        for patch, z in zip(panel.patches, drawn.values(), strict=True):
            heights, edges, _ = patch.get_data()
            assert np.sum(heights * np.diff(edges)) == pytest.approx(1)
            middle = (edges[1:] + edges[:-1]) / 2
            assert np.sum(middle * heights * np.diff(edges)) == pytest.approx(z[:, k - 1].mean(), abs=np.diff(edges)[0])
        x, bell = panel.lines[0].get_xydata().T
        assert x[bell.argmax()] == pytest.approx(probe[k - 1], abs=0.02)
        assert bell.max() == pytest.approx(1 / (0.5 * np.sqrt(2 * np.pi)), rel=1e-3)


def test_trajectories_follow_hands_and_feet_along_the_heading():
    motion = walk()
    (panel,) = plotting.trajectories(motion).axes
    points = markers(motion.poses, BODY)
    ways = {line.get_label(): line.get_xydata() for line in panel.lines}
    assert set(ways) == {f"{side} {joint}" for side in ("left", "right") for joint in ("wrist", "ankle")}
    for label, way in ways.items():
        point = points[:, MARKERS.index(label.replace(" ", "_"))]
        np.testing.assert_allclose(way[:, 1], point[:, 2])
        np.testing.assert_allclose(way[:, 0], point[:, :2] @ [np.cos(0.87), np.sin(0.87)], atol=1e-12)
    grey = np.array(panel.collections[0].get_segments())
    assert len(grey) % len(motion.poses) == 0
    assert np.ptp(grey[..., 0]) > 39 / 30


VIEWS = np.radians(np.arange(-90, 91))
BOTH = {"approach I": 800 + 100 * np.cos(VIEWS), "approach II": 500 + 90 * np.cos(VIEWS)}
FOUND = {name: np.random.default_rng(k).normal(0.02, 0.05, (7, 181)) for k, name in enumerate(BOTH)}


def test_error_over_variance_marks_the_chosen_one():
    candidates = np.array([1, 25, 70, 300, 625])
    (panel,) = figures.error_over_variance(candidates, {"N = 30": [9, 7, 6, 7, 8]}, chosen=70).axes
    curve, mark = panel.lines
    np.testing.assert_array_equal(curve.get_xydata(), np.stack([candidates, [9, 7, 6, 7, 8]], -1))
    assert mark.get_xdata()[0] == 70
    assert "mm²" in panel.get_xlabel()


def test_over_views_draws_approach_one_solid_and_two_dashed_over_degrees():
    (panel,) = figures.over_views(VIEWS, BOTH, "error [mm²]").axes
    assert [line.get_linestyle() for line in panel.lines] == ["-", "--"]
    for line, (name, curve) in zip(panel.lines, BOTH.items(), strict=True):
        assert line.get_label() == name
        np.testing.assert_allclose(line.get_xydata(), np.stack([np.arange(-90, 91), curve], -1))
    assert panel.get_ylabel() == "error [mm²]"


def test_recovered_views_are_mean_and_deviation_in_degrees():
    panels = figures.recovered_views(VIEWS, FOUND).axes
    for panel, (name, error) in zip(panels, FOUND.items(), strict=True):
        assert panel.get_title() == name
        mean, above, below, true = (line.get_ydata() for line in panel.lines)
        np.testing.assert_allclose(true, np.arange(-90, 91))
        np.testing.assert_allclose(mean, true + np.rad2deg(error.mean(0)))
        np.testing.assert_allclose([above - mean, mean - below], [np.rad2deg(error.std(0))] * 2, atol=1e-9)


def test_no_curve_leaves_its_panel():
    mean, modes = cycle()
    drawn = (
        plotting.components(mean, modes, ANGLES),
        plotting.trajectories(walk()),
        plotting.pose_samples(walk().poses[0], walk().poses[None, :20], BODY, ["20"]),
        plotting.coefficient_histograms(draws(), np.zeros(16), 1.0),
        figures.over_views(VIEWS, BOTH, "error"),
        figures.recovered_views(VIEWS, FOUND),
    )
    for figure in drawn:
        figure.draw_without_rendering()
        for panel in figure.axes:
            low, high = panel.get_ylim()
            assert all(low <= y <= high for line in panel.lines for y in line.get_ydata())
            assert all(
                low <= y <= high for lines in panel.collections for stick in lines.get_segments() for _, y in stick
            )


def test_same_data_same_picture_and_pyplot_stays_out():
    before = "matplotlib.pyplot" in sys.modules
    a, b = (saved(plotting.components(*cycle(), ANGLES)) for _ in range(2))
    assert a == b
    assert a[:4] == b"\x89PNG"
    assert ("matplotlib.pyplot" in sys.modules) == before
