"""Gait of lifted people: against motions whose angles, events and steps are known, and by simulation."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import GapError, MotionError
from motionenv.gait import Stride, analyse
from motionenv.lifting import gait_of, lift, project_markers
from motionenv.lifting.free import lifter
from motionenv.lifting.gait import NAMES, LiftedGait, _analysed, _parameters, _Walk, doubts_about
from motionenv.lifting.pipeline import motion_of
from motionenv.lifting.report import gait_figures, gait_page, write_angles, write_gait
from motionenv.lifting.saving import write_lifted
from motionenv.mocap import read, to_markers
from motionenv.mocap.clinical import clinical_angles
from motionenv.models.synthesis import synthesize
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Markers, Points

FPS = 30.0
MOTION = synthesize("walk/fpca", 5, FPS, seed=4)
PLACES = markers(MOTION.poses, MOTION.skeleton)
M = {name: i for i, name in enumerate(MARKERS)}


def seen(view: float, **more) -> tuple[Points, object]:
    camera = fit_view(PLACES, view, elevation=0.1)
    return Points(camera.project(PLACES)[0], FPS, "px", **more), camera


@pytest.fixture(scope="module")
def side() -> LiftedGait:
    points, camera = seen(0.1, name="side")
    feet = analyse(MOTION).feet
    ends = np.stack([getattr(feet, part)[s] for s in ("left", "right") for part in ("heel", "toe")], axis=1)
    return gait_of(lift(replace(points, feet=camera.project(ends)[0]), camera=camera), draws=16)


def test_exact_points_have_the_angles_of_their_motion():
    true = clinical_angles(MOTION)
    found = _analysed(PLACES, None, FPS)
    for name in (
        "left_hip_flexion",
        "right_hip_flexion",
        "left_hip_adduction",
        "left_knee_flexion",
        "right_knee_flexion",
    ):
        # hips are measured from a pelvis that tilts by 7 degrees, not from the trunk
        tilt = 7.0 - found.angles[:, NAMES.index("left_trunk_tilt")] if name.endswith("hip_flexion") else 0.0
        np.testing.assert_allclose(found.angles[:, NAMES.index(name)], true[name] + tilt, atol=0.7, err_msg=name)


def test_trunk_and_pelvis_turn_as_they_were_turned():
    """A stiff figure that goes along y, leans forward by 10 degrees and has its hips turned to the left by 8."""
    body = PLACES[0] - PLACES[0, M["pelvis"]]
    lean, turn = np.radians([10.0, 8.0])
    tilt = np.array([[np.cos(lean), 0, np.sin(lean)], [0, 1, 0], [-np.sin(lean), 0, np.cos(lean)]])
    yaw = lambda a: np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    upper = [i for name, i in M.items() if name.endswith(("shoulder", "elbow", "wrist")) or name in ("head", "sternum")]
    shoulders = body[[M["left_shoulder"], M["right_shoulder"]]]
    body[[M["left_hip"], M["right_hip"]]] = [[0, 0.09, 0], [0, -0.09, 0]]
    body[[M["left_shoulder"], M["right_shoulder"]]] = np.abs(shoulders.mean(0)) * [0, 0, 1] + [
        [0, 0.18, 0],
        [0, -0.18, 0],
    ]
    body[upper] = body[upper] @ tilt.T
    hips = [M["left_hip"], M["right_hip"]]
    body[hips] = body[hips] @ yaw(turn).T
    places = body @ yaw(np.pi / 2).T + np.arange(90)[:, None, None] / FPS * [0, 1.2, 0] + [0, 0, 0.9]
    angles = _analysed(places, None, FPS).angles
    at = lambda name: angles[45, NAMES.index(name)]
    assert at("left_trunk_tilt") == pytest.approx(10, abs=0.5)
    assert at("left_pelvis_rotation") == pytest.approx(-8, abs=0.2)  # external of the left side
    assert at("right_pelvis_rotation") == pytest.approx(8, abs=0.2)
    assert at("left_pelvis_obliquity") == pytest.approx(0, abs=0.2)


def test_a_walk_from_the_side_is_told_as_it_was(side):
    exact, trial = _analysed(PLACES, None, FPS).angles, analyse(MOTION)
    true = dict(zip(NAMES, exact.T, strict=True))
    for name in ("left_knee_flexion", "right_knee_flexion", "left_hip_flexion"):
        off = side[name] - true[name]
        assert np.sqrt((off**2).mean()) < 5, name
        low, high = side.band(name)
        assert np.mean((low <= true[name]) & (true[name] <= high)) > 0.7, name
    shank_still = side["left_ankle_dorsiflexion"]  # the body's ankles are stiff but for what keeps feet off the ground
    assert np.isfinite(shank_still).all()
    own = {p.name: p for p in side.parameters if not p.side}
    speed = np.mean([s.speed for s in trial.steady])
    assert own["speed"].low < speed < own["speed"].high
    assert own["stride_time"].mean == pytest.approx(np.mean([s.seconds for s in trial.steady]), abs=0.02)
    assert not any(p.name.endswith("_cv") for p in side.parameters)
    contacts = [e.time for e in side.events if (e.kind, e.side) == ("initial_contact", "left")]
    for time in trial.events.times("initial_contact", "left"):
        assert min(abs(time - found) for found in contacts) < 0.08
    assert {"pelvis_tilt", "hip_rotation", "knee_rotation"} <= set(side.undetermined)
    assert "camera's height" in side.scale


def test_the_same_seed_gives_the_same_figures(side):
    again = gait_of(side.lifted, draws=16, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(again.deviations, side.deviations)
    assert again.parameters == side.parameters
    with pytest.raises(MotionError, match="draws must be a whole number"):
        gait_of(side.lifted, draws=2)


def test_bands_hold_nine_tenths_of_motions_drawn_from_the_posterior():
    points, camera = seen(0.8)
    lifted = lift(points, camera=camera)
    found = gait_of(lifted, draws=48)
    inside = []
    for one in lifted.draws(12, np.random.default_rng(7)):
        true = clinical_angles(motion_of(one, FPS))
        for name in ("left_knee_flexion", "right_knee_flexion"):  # hips' hold people's pelves, too
            low, high = found.band(name)
            inside.append(np.mean((low <= true[name]) & (true[name] <= high)))
    assert 0.8 < np.mean(inside) < 0.98


def strides(lengths, late=0.0) -> _Walk:
    """A walk of strides of those lengths [m], of a second each."""
    found = tuple(
        Stride(("left", "right")[k % 2], k, k + 1.0 + late, toe_off=k + 0.6, opposite_off=k + 0.1,
               opposite_contact=k + 0.5, length=length, step_length=0.5 * length, step_width=0.1)
        for k, length in enumerate(lengths)
    )  # fmt: skip
    return _Walk(np.empty((0, 32)), None, {}, (), found)


def test_intervals_of_parameters_hold_nine_tenths_of_true_means():
    """Strides vary by 5 cm; the lifting stretches all of them by 3 % (of which its draws tell), and jitters each."""
    rng, inside = np.random.default_rng(0), []
    for _ in range(400):
        true = 1.4 + 0.05 * rng.standard_normal(6)
        estimate = true * np.exp(0.03 * rng.standard_normal())
        draws = [strides(estimate * np.exp(0.03 * rng.standard_normal())) for _ in range(32)]
        p = next(p for p in _parameters(strides(estimate), draws) if p.name == "stride_length" and not p.side)
        inside.append(p.low < 1.4 < p.high)
    assert 0.86 < np.mean(inside) < 0.94


def test_parameters_that_few_draws_have_are_left_out():
    drawn = [strides([1.4, 1.4])] * 3 + [strides([])] * 9
    assert _parameters(strides([1.4, 1.4]), drawn) == ()


def test_two_stretches_are_joined_with_the_spread_of_one(monkeypatch):
    monkeypatch.setattr(lifter, "_STRETCH", 2.5)
    monkeypatch.setattr(lifter, "_OVERLAP", 1.0)
    points, camera = seen(0.8)
    fit = lifter.fit_freely(points, camera)
    drawn = fit.draws(300, np.random.default_rng(0))[0]
    about = np.delete(drawn - drawn[:, :, [2]], 2, axis=2)
    ratio = (about.std(axis=0) / np.delete(fit.deviations, 2, axis=1)).mean(axis=(1, 2))
    assert (np.abs(ratio - 1) < 0.25).all()
    steps = np.abs(np.diff(about, axis=1)).mean(axis=(0, 2, 3))
    assert steps.max() < 3 * np.median(steps)


def test_the_gait_of_points_in_metres_is_at_their_size():
    found = lift(project_markers(Markers(MARKERS, PLACES, FPS), 0.6))
    gait = gait_of(found, draws=16)
    assert gait.scale.startswith("Sizes are those of the points' metres, ± 1 %")
    assert any("too short by about a fifth" in warning for warning in gait.warnings)
    speed = next(p for p in gait.parameters if p.name == "speed")
    assert speed.low < np.mean([s.speed for s in analyse(MOTION).steady]) < speed.high


def test_a_guessed_lens_makes_ways_towards_the_camera_uncertain():
    points, camera = seen(1.5)
    widths = []
    for known in (camera.K, None):
        gait = gait_of(lift(points, camera=known, elevation=0.1, height=MOTION.skeleton.height), draws=16)
        assert "person's height" in gait.scale
        widths += [p.high - p.low for p in gait.parameters if p.name == "speed"]
    assert widths[1] > 2 * widths[0]


def test_hidden_joints_and_strange_postures_are_cut_out():
    points, camera = seen(0.1)
    hidden = points.positions.copy()
    hidden[60:90, M["left_ankle"]] = np.nan
    lifted = lift(replace(points, positions=hidden), camera=camera)
    surprise = lifted.free.surprise.copy()
    surprise[120:130] = 1.0
    found = gait_of(replace(lifted, free=replace(lifted.free, surprise=surprise)), draws=8)
    assert np.isnan(found["left_knee_flexion"][60:90]).all()
    assert np.isfinite(found["right_knee_flexion"][60:90]).all()
    assert np.isnan(found.angles[120:130]).all()
    assert [(c.start, c.end) for c in found.cut] == [(2.0, 3.0), (4.0, pytest.approx(130 / 30))]
    assert "left ankle is hidden" in found.cut[0].why
    with pytest.raises(GapError, match="nobody who walks"):
        gait_of(replace(lifted, free=replace(lifted.free, surprise=np.ones_like(surprise))))


def test_a_frame_rate_that_makes_people_too_quick_is_told(side):
    points, camera = seen(0.1)
    fast = gait_of(lift(replace(points, fps=2 * FPS), camera=camera), draws=8)
    assert any("quicker than people's" in warning for warning in fast.warnings)
    assert not any("quicker than people's" in warning for warning in side.warnings)


def test_without_heels_and_toes_ankles_are_not_told():
    points, camera = seen(0.1)
    found = gait_of(lift(points, camera=camera), draws=8)
    assert "no heels and toes" in found.undetermined["ankle_dorsiflexion"]
    assert np.isnan(found["left_ankle_dorsiflexion"]).all()
    assert found.feet.notes


def test_the_page_the_table_and_the_figures_agree(side, tmp_path):
    write_gait(side, tmp_path / "walk.html")
    page = (tmp_path / "walk.html").read_text()
    assert page == gait_page(side)
    assert "camera&#x27;s height" in page
    assert "Not told: pelvis tilt" in page
    assert page.index("Not told") < page.index("Joint angles")
    write_angles(side, tmp_path / "walk.csv")
    rows = list(csv.DictReader((tmp_path / "walk.csv").read_text().splitlines()))
    knee = [row for row in rows if row["angle"] == "left_knee_flexion"]
    np.testing.assert_allclose([float(row["degrees"]) for row in knee], side["left_knee_flexion"], atol=0.006)
    np.testing.assert_allclose([float(row["high"]) for row in knee], side.band("left_knee_flexion")[1], atol=0.006)
    assert not any("hip_rotation" in row["angle"] for row in rows)
    told = json.loads(json.dumps(gait_figures(side), default=lambda values: values.tolist()))
    assert told["scale"] == side.scale
    assert len(told["events"]) == len(side.events)
    for write, name in ((write_gait, "walk.pdf"), (write_angles, "walk.xlsx")):
        with pytest.raises(MotionError, match="must end in"):
            write(side, tmp_path / name)


def test_files_hold_all_that_is_known(side, tmp_path):
    lifted, motion = side.lifted, side.lifted.motion()
    write_lifted(lifted, motion, tmp_path / "walk.npz")
    np.testing.assert_array_equal(read(tmp_path / "walk.npz").poses, motion.poses)
    with np.load(tmp_path / "walk.npz") as file:
        for name in ("positions", "band", "confidence", "contact", "unlike", "swapped", "feet"):
            np.testing.assert_array_equal(file[name], getattr(lifted, name))
        assert float(file["unit"]) == lifted.free.unit
    write_lifted(lifted, motion, tmp_path / "walk.csv")
    rows = list(csv.DictReader((tmp_path / "walk.csv").read_text().splitlines()))
    assert float(rows[3]["left_knee_band_y_m"]) == lifted.band[3, M["left_knee"], 1]
    assert float(rows[3]["head_confidence"]) == lifted.confidence[3, 0]
    assert {row["unlike"] for row in rows} == {"0.0"}


@pytest.mark.parametrize(("ratio", "says"), [(1.0, None), (9 / 16, "made narrower"), (16 / 9, "made wider")])
@pytest.mark.parametrize("trial", ["07/07_01", "16/16_15"])
def test_a_picture_that_was_made_wider_or_narrower_is_doubted(mocap, trial, ratio, says):
    """As points relative to width and height are, or 4:3 shown as 16:9 but more; captured people, obliquely."""
    walk = to_markers(read(mocap / f"cmu_asfamc/{trial}.amc", fps=120)).positions[::4]
    seen_ = fit_view(walk, 0.6, elevation=0.1).project(walk)[0] * [ratio, 1]
    lifted = lift(Points(seen_, FPS, "px"), elevation=0.1)
    doubts = doubts_about(lifted)
    assert doubts == [] if says is None else says in doubts[0]


@pytest.mark.parametrize(("rate", "says"), [(FPS, ""), (2 * FPS, "quicker"), (FPS / 2, "slower, for their length,")])
def test_half_and_twice_the_frame_rate_are_doubted(mocap, rate, says):
    walk = to_markers(read(mocap / "cmu_asfamc/07/07_01.amc", fps=120)).positions[::4]
    walk = lift(Points(fit_view(walk, 0.3).project(walk)[0], rate, "px"), height=1.75)
    told = " ".join(gait_of(walk, draws=8).warnings)
    assert says in told
    assert bool(says) == ("check the frame rate" in told)
