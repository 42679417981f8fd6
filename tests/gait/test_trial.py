"""Whole captures, and several walks of one person."""

from dataclasses import astuple

import numpy as np
import pytest

from motionenv.errors import GapError, MotionError
from motionenv.gait import Session, analyse, read_session, read_trial, summarise
from motionenv.gait.trial import ANGLES
from motionenv.mocap import read, write, write_markers
from motionenv.mocap.clinical import CLINICAL_ANGLES
from motionenv.models.synthesis import synthesize
from motionenv.types import Markers

WANDS = "btkdata/C3DSamples/c3d.org/sample04/sub_labels.c3d"
PIG = "btkdata/C3DSamples/PiG/"


def test_a_laboratorys_file(mocap):
    trial = read_trial(mocap / f"{PIG}PiG_Motion3_FF.c3d")
    assert (trial.name, trial.notes, trial.seconds) == ("PiG_Motion3_FF", (), 2.93)
    assert [s.kind for s in trial.stretches] == ["steady"]
    assert trial.events.sources == {"file": 12}
    assert len(trial.strides) == 4
    assert 0.6 < trial.leg_length < 1.1


def test_curves_are_the_angles_between_contacts(mocap):
    trial = read_trial(mocap / f"{PIG}PiG_Motion3_FF.c3d")
    knee = ANGLES.index("knee_flexion")
    for side in ("left", "right"):
        strides = [s for s in trial.strides if s.side == side]
        curves = trial.curves(side)
        assert curves.shape == (len(strides), 101, 13)
        column = CLINICAL_ANGLES.index(f"{side}_knee_flexion")
        for stride, curve in zip(strides, curves, strict=True):
            for percent, time in ((0, stride.start), (100, stride.end)):
                wanted = trial.angles.values[round(time * trial.feet.fps), column]
                assert curve[percent, knee] == pytest.approx(wanted, abs=0.05)
            assert 60 < np.argmax(curve[:, knee]) < 85  # the knee bends most in swing
    assert trial.both_sides().shape == (4, 101, 13)


def test_motion_and_moved_captures(mocap):
    motion = synthesize("walk/fpca", seconds=5, fps=60, seed=4)
    assert len(analyse(motion).strides) >= 4
    markers = read(mocap / f"{PIG}PiG_Motion3_FF.c3d")
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved = Markers(markers.names, markers.positions @ turn.T + [5, 2, 0], markers.fps, recording=markers.recording)
    a, b = analyse(markers), analyse(moved)
    np.testing.assert_allclose([s.step_length for s in a.strides], [s.step_length for s in b.strides])
    np.testing.assert_allclose(a.both_sides(), b.both_sides(), atol=1e-5)


def test_notes_say_what_a_reader_should_know(mocap):
    notes = lambda file: " ".join(read_trial(mocap / file, unit="mm").notes)
    assert "no stride was found" in notes(f"{PIG}PiG_Calibration3_FF.c3d")
    assert "only the right leg" in notes("btkdata/C3DSamples/c3d.org/sample21/sample21.c3d")
    running = notes("nimble/osim/HamnerSubject04/subject04/trials/run500/markers.trc")
    assert "this is running" in running
    assert "stays in place" in running
    assert "ankle stands in" in notes("btkdata/C3DSamples/others/561xxa01_anonym.C3D")


def test_a_walk_run_backwards_is_told(mocap):
    markers = read(mocap / "cmu_c3d/02_01.c3d")
    back = Markers(markers.names, markers.positions[::-1], markers.fps)
    assert "goes backwards" in " ".join(analyse(back).notes)
    assert "backwards" not in " ".join(analyse(markers).notes)


def test_a_single_frame_is_refused(mocap):
    with pytest.raises(GapError, match="has 1 frame: a standing trial goes to --static"):
        read_trial(mocap / f"{PIG}PiG_Calibration-FlatFoot-One.c3d")


def test_captures_are_taken_together(mocap):
    paths = [mocap / f"{PIG}PiG_Motion-FlatFoot-{name}.c3d" for name in ("Full", "One")]
    seen = []
    session = read_session(paths, on_step=seen.append)
    trials = [read_trial(path) for path in paths]
    assert seen == [path.name for path in paths]
    assert session.strides == tuple(s for t in trials for s in t.strides)
    assert session.person == (trials[0].person or trials[0].name)
    assert repr(session) == f"Session({session.person!r}, 2 captures, {len(session.strides)} strides)"
    assert repr(trials[0]).endswith(f"{trials[0].seconds:.1f} s, {len(trials[0].strides)} strides)")
    leg = float(np.mean([t.leg_length for t in trials]))
    np.testing.assert_equal([*map(astuple, session.parameters)], [*map(astuple, summarise(session.strides, leg))])
    curves = np.concatenate([t.curves("left") for t in trials])
    np.testing.assert_array_equal(session.curves["left"], curves)
    mean, sd = session.mean_curve("left", "knee_flexion")
    np.testing.assert_allclose(mean, curves[:, :, ANGLES.index("knee_flexion")].mean(0))
    assert (sd >= 0).all()
    stance = [100 * (s.toe_off - s.start) / s.seconds for s in session.strides if s.side == "left"]
    assert session.toe_off("left") == pytest.approx(np.mean(stance))


@pytest.mark.parametrize("walk", ["osim/LaiArnoldSubject6/walking1", "grf/Subject4/MarkerData/walking2"])
def test_a_trial_cut_at_two_contacts_has_the_stride_between_toe_offs(mocap, walk):
    """As OpenSim's and OpenCap's are cut. Its curves begin at the contact, and meet where its ends do."""
    trial = read_trial(mocap / f"nimble/{walk}.trc")
    (stride,) = trial.strides
    assert trial.events.times("toe_off", stride.side) == pytest.approx([stride.start, stride.end])
    assert trial.events.times("initial_contact", stride.side) == pytest.approx([stride.contact])
    assert "contact is seen twice" in " ".join(trial.notes)
    knee = trial.curves(stride.side)[0, :, ANGLES.index("knee_flexion")]
    assert np.nanargmax(knee) == pytest.approx(72, abs=5)
    assert np.nanmax(np.abs(np.diff(knee))) < 10
    parameters = {(p.name, p.side) for p in summarise(trial.strides, None)}
    assert ("speed", "") in parameters
    assert not any(name in ("stance", "step_length", "double_support") for name, _ in parameters)


def test_the_choice_about_wands_reaches_the_angles_and_the_page(mocap, tmp_path, run):
    """In this file the wands aren't in the plane of the knee's axis; angles that are known without them are fewer."""
    path = mocap / WANDS
    notes = {wands: " ".join(read_trial(path, wands=wands).notes) for wands in ("auto", "use", "ignore")}
    assert "wands of the thighs: left out" in notes["auto"]
    assert "wands of the thighs: used, though" in notes["use"]
    assert "wands" not in notes["ignore"]
    for wands in ("auto", "use"):
        assert run("report", path, "--wands", wands, "--out", tmp_path / f"{wands}.html").code == 0
        assert notes[wands].partition("wands: ")[2][:20] in (tmp_path / f"{wands}.html").read_text(encoding="utf-8")
    wrong = run("report", path, "--wands", "yes", "--out", tmp_path / "a.html").err
    assert "wands must be one of auto, use, ignore" in wrong


def test_files_that_cant_be_used_are_told(mocap):
    walk, empty = mocap / f"{PIG}PiG_Motion3_FF.c3d", mocap / "btkdata/TRCSamples/Empty.trc"
    session = read_session([empty, walk])
    assert [t.name for t in session.trials] == [walk.stem]
    assert "empty" in session.left_out["Empty.trc"]
    with pytest.raises(MotionError, match="no file can be analysed; the first, .*empty"):
        read_session([empty])
    with pytest.raises(MotionError, match="at least one capture"):
        read_session([])


def test_a_standing_trial_must_hold_markers(mocap, tmp_path):
    walk, standing = (mocap / f"{PIG}PiG_{name}.c3d" for name in ("Motion3_FF", "Calibration3_FF"))
    assert read_session([walk], static=standing).strides
    write(synthesize("walk/fpca", seconds=1, fps=30, seed=1), tmp_path / "fitted.npz")
    with pytest.raises(MotionError, match="must hold markers"):
        read_session([walk], static=tmp_path / "fitted.npz")


def test_standing_has_no_parameters(mocap):
    session = read_session([mocap / f"{PIG}PiG_Calibration3_FF.c3d"])
    assert isinstance(session, Session)
    assert session.parameters == ()
    assert np.isnan(session.toe_off("left"))
    assert np.isnan(session.mean_curve("left", "hip_flexion")[0]).all()


def leg_of(capture: Markers, fps: float) -> Markers:
    return Markers(capture.names, capture.positions, fps)


def test_a_frame_rate_that_makes_people_too_quick_is_doubted_and_can_be_given(mocap, tmp_path):
    """Twice the frame rate makes steps of 0.26 s. What is given then goes before what the file states."""
    path = mocap / f"{PIG}PiG_Motion-FlatFoot-Full.c3d"
    walk = read(path)
    assert analyse(walk).doubts == ()
    fast = tmp_path / "fast.trc"
    write_markers(leg_of(walk, 2 * walk.fps), fast)
    (doubt,) = read_session([fast]).trials[0].doubts
    assert "quicker than people's with legs of 0." in doubt
    (mended,) = read_session([fast], fps=walk.fps).trials
    assert mended.doubts == ()
    seconds = np.median([stride.seconds for stride in analyse(walk).strides])
    assert np.median([stride.seconds for stride in mended.strides]) == pytest.approx(seconds, abs=0.02)


def test_slow_motion_is_doubted_and_slow_people_are_not(mocap):
    """Half the frame rate: strides of 2.4 s that are as long as those of 1.2 s. Slow people's are shorter."""
    walk = read(mocap / f"{PIG}PiG_Motion-FlatFoot-Full.c3d")
    (doubt,) = analyse(leg_of(walk, walk.fps / 2)).doubts
    assert "slower, for their length, than people's" in doubt
    assert "frame rate" in doubt
    slow = read_trial(mocap / "btkdata/C3DSamples/c3d.org/sample01/Eb015pi.c3d")  # strides of 2.5 s
    assert "slower" not in " ".join(slow.doubts)


def test_toddlers_legs_do_not_step_as_slowly_as_adults(mocap):
    """Inches called centimetres. A toddler of that size swings legs as a pendulum of their length does."""
    walk = read(mocap / f"{PIG}PiG_Motion-FlatFoot-Full.c3d")
    small = Markers(walk.names, walk.positions / 2.54, walk.fps)
    (doubt,) = analyse(small).doubts
    assert "slower than people's with legs of 0.3" in doubt
    toddler = Markers(walk.names, walk.positions / 2.54, walk.fps * np.sqrt(2.54))
    assert analyse(toddler).doubts == ()


@pytest.mark.parametrize("run", ["run200", "run500"])
def test_runners_are_not_too_quick(mocap, run):
    assert read_trial(mocap / f"nimble/osim/HamnerSubject04/subject04/trials/{run}/markers.trc").doubts == ()


def test_who_turns_to_walk_backwards_is_doubted(mocap):
    walk = read(mocap / f"{PIG}PiG_Motion3_FF.c3d")
    both = Markers(walk.names, np.concatenate([walk.positions, walk.positions[::-1]]), walk.fps)
    assert any("feet point backwards" in doubt for doubt in analyse(both).doubts)


@pytest.mark.parametrize("lost", ["LKNE", "LANK"])
def test_a_leg_without_a_joint_still_takes_steps(mocap, lost):
    """Heel and toe tell all step parameters."""
    walk = read(mocap / f"{PIG}PiG_Motion3_noFF.c3d")
    kept = [i for i, name in enumerate(walk.names) if name != lost]
    part = Markers([walk.names[i] for i in kept], walk.positions[:, kept], walk.fps)
    whole, less = (analyse(leg_of(capture, walk.fps)) for capture in (walk, part))
    assert [s.step_length for s in less.strides] == pytest.approx([s.step_length for s in whole.strides], abs=0.01)
    assert not any("was captured" in note for note in less.notes)
    assert np.isnan(less.angles["left_knee_flexion"]).all()
