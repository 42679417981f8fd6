"""Step parameters against closed forms and SciPy's intervals."""

import json

import numpy as np
import pytest
from scipy import stats

from motionenv.gait import Stride, feet_of, find_events, find_stretches, find_strides, summarise
from motionenv.models.synthesis import synthesize
from tests.gait.walkers import truth, walker


def drawn(n=14) -> list[Stride]:
    """Strides of both sides with random figures."""
    random = np.random.default_rng(1)
    found = []
    for i in range(n):
        a, length = i * 0.6, random.normal(1.4, 0.05)
        b = a + random.normal(1.1, 0.03)
        at = [a + share * (b - a) for share in random.normal([0.62, 0.12, 0.5], 0.01)]
        side = ("left", "right")[i % 2 if i < n - 2 else 0]
        found.append(Stride(side, a, b, *at, length, random.normal(0.7, 0.03), random.normal(0.1, 0.02)))
    return found


def by_name(strides, **options) -> dict:
    return {(p.name, p.side): p for p in summarise(strides, **options)}


def test_a_known_walker():
    feet = walker()
    found = by_name(find_strides(feet, truth(), find_stretches(feet)), leg_length=0.9)
    wanted = {
        "speed": 1.4 / 1.1, "cadence": 120 / 1.1, "walk_ratio": 0.7 / (120 / 1.1), "stride_length": 1.4,
        "step_length": 0.7, "step_width": 0.12, "stride_time": 1.1, "step_time": 0.55, "stance": 62, "swing": 38,
        "single_support": 38, "double_support": 24, "dimensionless_speed": 1.4 / 1.1 / np.sqrt(9.81 * 0.9),
        "step_length_symmetry": 0, "step_time_symmetry": 0, "stance_symmetry": 0, "stride_time_cv": 0,
    }  # fmt: skip
    for name, value in wanted.items():
        assert found[name, ""].mean == pytest.approx(value, rel=2e-3, abs=0.05 if value == 0 else 0), name
    assert ("dimensionless_speed", "") not in by_name(drawn())


def test_intervals_are_students():
    found = by_name(drawn())
    times = np.array([s.seconds for s in drawn()])
    for values, p in ((times, found["stride_time", ""]), (times[:-2:2].tolist() + times[-2:].tolist(), None)):
        p = p or found["stride_time", "left"]
        low, high = stats.t.interval(0.95, len(values) - 1, np.mean(values), stats.sem(values))
        assert (p.mean, p.low, p.high, p.n) == (pytest.approx(np.mean(values)), pytest.approx(low),
                                                pytest.approx(high), len(values))  # fmt: skip
        assert p.sd == pytest.approx(np.std(values, ddof=1))


def test_symmetry_has_welchs_interval():
    left, right = ([s.step_length for s in drawn() if s.side == side] for side in ("left", "right"))
    p = by_name(drawn())["step_length_symmetry", ""]
    scale = 100 / (0.5 * (np.mean(left) + np.mean(right)))
    welch = stats.ttest_ind(left, right, equal_var=False).confidence_interval(0.95)
    assert p.mean == pytest.approx(scale * (np.mean(left) - np.mean(right)))
    assert (p.low, p.high) == (pytest.approx(scale * welch.low), pytest.approx(scale * welch.high))


def test_variability_has_a_chi_square_interval():
    """Of one side, where pooling changes nothing; the interval holds the true value in 95 % of samples."""
    random = np.random.default_rng(4)
    held = []
    for _ in range(400):
        ends = random.normal(1.1, 0.033, 9)
        p = by_name([Stride("left", 0.0, e) for e in ends])["stride_time_cv", ""]
        assert p.mean == pytest.approx(100 * np.std(ends, ddof=1) / np.mean(ends))
        held.append(p.low <= 3.0 <= p.high)
    assert 0.92 < np.mean(held) < 0.98


def test_few_strides_have_no_interval():
    one = by_name([Stride("left", 0.0, 1.1, length=1.4)])
    p = one["stride_length", "left"]
    assert (p.mean, p.n) == (1.4, 1)
    assert np.isnan([p.sd, p.low, p.high]).all()
    assert not {name for name, _ in one} & {"stance", "step_length", "step_length_symmetry", "stride_time_cv"}
    assert json.loads(json.dumps(p.to_dict(), allow_nan=False))["sd"] is None
    pair = by_name([*drawn()[:2], drawn()[2]])  # two left strides and one right
    assert not [name for name, _ in pair if name.endswith("symmetry")]
    assert summarise([]) == ()


def test_equal_figures_have_an_interval_of_no_width():
    same = [Stride(side, float(i), i + 1.1, i + 0.7, i + 0.1, i + 0.5, 1.4, 0.7, 0.1)
            for i in range(4) for side in ("left", "right")]  # fmt: skip
    p = by_name(same)["step_length_symmetry", ""]
    assert (p.mean, p.low, p.high) == (0, 0, 0)


@pytest.mark.parametrize("speed", [0.9, 1.4])
def test_synthesised_walkers_walk_at_the_speed_that_was_asked_for(speed):
    feet = feet_of(synthesize("walk/fpca", seconds=10, fps=100, seed=2, speed=speed, variation=0))
    found = by_name(find_strides(feet, find_events(feet), find_stretches(feet)))
    assert found["speed", ""].mean == pytest.approx(speed, rel=0.03)
    assert found["step_length", ""].mean * found["cadence", ""].mean / 60 == pytest.approx(speed, rel=0.03)
    assert found["stance", ""].mean == pytest.approx(62, abs=5)
