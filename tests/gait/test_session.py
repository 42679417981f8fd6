"""Several walks of one person."""

from dataclasses import astuple

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.gait import Session, read_session, read_trial, summarise
from motionenv.gait.trial import ANGLES
from motionenv.mocap import write
from motionenv.models.synthesis import synthesize

PIG = "btkdata/C3DSamples/PiG/"


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
