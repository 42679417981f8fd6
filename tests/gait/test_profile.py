"""Movement Analysis Profile and Gait Profile Score against closed forms and a computation of their own."""

import math

import numpy as np
import pytest

from motionenv.gait import Band, Session, band_of, profile_of, read_trial, shipped_band
from motionenv.gait.bands import PROFILE_ANGLES
from motionenv.gait.trial import ANGLES

PERCENT = np.arange(101)


def reference(names=PROFILE_ANGLES, scores=()) -> Band:
    random = np.random.default_rng(3)
    mean = {name: random.normal(10, 5) + random.normal(0, 8) * np.sin(PERCENT * 2 * np.pi / 100) for name in names}
    return Band(mean, {name: np.ones(101) for name in names}, 7, "made up", dict(scores))


def person(band: Band, offsets: dict[str, list[float]]) -> dict[str, np.ndarray]:
    """Strides that are the reference, moved by an offset of each stride; other angles are unknown."""
    curves = {side: np.full((len(values), 101, len(ANGLES)), np.nan) for side, values in offsets.items()}
    for side, values in offsets.items():
        for k, name in enumerate(PROFILE_ANGLES):
            for i, value in enumerate(values):
                if name in band.mean:
                    curves[side][i, :, ANGLES.index(name)] = band.mean[name] + value + k
    return curves


def by_name(scores) -> dict:
    return {(s.name, s.side): s for s in scores}


def test_offsets_are_the_scores():
    """Moved by c + k degrees in angle k: its score is |c + k|, and the totals root mean squares of those."""
    band = reference()
    found = by_name(profile_of(person(band, {"left": [2.0, 4.0], "right": [-3.0]}), band))
    for k, name in enumerate(PROFILE_ANGLES):
        assert found[name, "left"].value == pytest.approx(3 + k)
        assert found[name, "right"].value == pytest.approx(abs(k - 3))
        assert (found[name, "left"].n, found[name, "right"].n, found[name, "left"].angles) == (2, 1, 1)
    left, right = [3 + k for k in range(9)], [abs(k - 3) for k in range(9)]
    for side, parts in (("left", left), ("right", right), ("", left + right[3:])):
        whole = found["gait_profile_score", side]
        assert whole.value == pytest.approx(math.sqrt(sum(v * v for v in parts) / len(parts)))
        assert whole.angles == len(parts)
    assert found["gait_profile_score", ""].n == 1
    assert np.isnan(found["gait_profile_score", ""].median)


def test_it_is_what_loops_over_the_capture_give(mocap):
    """A real walk, cut and compared with nothing of the library: frame by frame, angle by angle."""
    trial = read_trial(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    band = reference()
    scores = {}
    for side in ("left", "right"):
        for name in PROFILE_ANGLES:
            column = trial.angles.values[:, trial.angles.names.index(f"{side}_{name}")]
            each = []
            for stride in (s for s in trial.strides if s.side == side):
                total = 0.0
                for percent in range(101):
                    frame = (stride.start + percent / 100 * (stride.end - stride.start)) * trial.feet.fps
                    before, share = int(frame), frame % 1
                    value = column[before] + (share * (column[before + 1] - column[before]) if share else 0.0)
                    total += (value - band.mean[name][percent]) ** 2
                each.append(math.sqrt(total / 101))
            scores[side, name] = sum(each) / len(each)
    found = by_name(Session((trial,), {}, band).profile)
    for (side, name), value in scores.items():
        assert found[name, side].value == pytest.approx(value, abs=1e-6), (side, name)
    fifteen = [v for (side, name), v in scores.items() if side == "left" or not name.startswith("pelvis")]
    assert len(fifteen) == found["gait_profile_score", ""].angles == 15
    assert found["gait_profile_score", ""].value == pytest.approx(math.sqrt(sum(v * v for v in fifteen) / 15))


def test_without_an_angle_it_is_no_gait_profile_score():
    band = reference(("hip_flexion", "knee_flexion"))
    found = by_name(profile_of(person(band, {"left": [1.0], "right": [1.0]}), band))
    assert not {side for name, side in found if name == "gait_profile_score"}
    assert {side: found["deviation", side].angles for side in ("left", "right", "")} == {"left": 2, "right": 2, "": 4}
    one = by_name(profile_of(person(reference(), {"left": [1.0], "right": []}), reference()))
    assert [side for name, side in one if name == "gait_profile_score"] == ["left"]  # none of both from one
    assert not [side for name, side in one if name == "deviation"]


def test_a_stride_with_a_gap_does_not_count():
    band = reference()
    curves = person(band, {"left": [2.0, 4.0], "right": [1.0]})
    curves["left"][1, 50, ANGLES.index("knee_flexion")] = np.nan
    found = by_name(profile_of(curves, band))
    assert (found["knee_flexion", "left"].value, found["knee_flexion", "left"].n) == (pytest.approx(2 + 6), 1)
    assert (found["hip_flexion", "left"].n, found["gait_profile_score", "left"].n) == (2, 1)


def test_the_groups_own_scores_are_each_against_the_others(people):
    band = band_of(people, "three")
    knee = ANGLES.index("knee_flexion")
    strides = {
        p: {s: [c[:, knee] for t in ts for c in t.curves(s)] for s in ("left", "right")} for p, ts in people.items()
    }
    means = {p: np.mean(of["left"] + of["right"], axis=0) for p, of in strides.items()}
    own = []
    for p, of in strides.items():
        others = sum(m for q, m in means.items() if q != p) / 2
        own.append(np.mean([math.sqrt(np.mean((curve - others) ** 2)) for curve in of["left"]]))
    np.testing.assert_allclose(band.scores["left_knee_flexion"], own)
    found = by_name(Session(tuple(people["a"]), {}, band).profile)["knee_flexion", "left"]
    assert (found.median, found.low, found.high) == pytest.approx((np.median(own), min(own), max(own)))


def test_a_member_of_the_shipped_group_is_within_its_range():
    band = shipped_band()
    assert {len(values) for values in band.scores.values()} == {band.people}
    assert {key.split("_", 1)[1] for key in band.scores} == set(PROFILE_ANGLES) & set(band.mean)
    assert all(0.5 < np.nanmedian(values) < 12 for values in band.scores.values())
