"""Registration of cycles against warps that are known."""

import numpy as np
import pytest

from motionenv.cycles import register
from motionenv.errors import MotionError
from motionenv.types import Cycles

P = 128
GRID = np.arange(P) / P


def bumps(phase: np.ndarray) -> np.ndarray:
    """A periodic curve with two peaks, at the phases 0.25 and 0.7."""
    near = lambda at, width: np.exp((np.cos(2 * np.pi * (phase - at)) - 1) / width)
    return near(0.25, 0.05) + 0.6 * near(0.7, 0.03)


def made(rng, n: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Cycles (n, P, 1) whose peaks come early or late, and the peaks' phases (n, 2)."""
    shifts = rng.uniform(-0.06, 0.06, (n, 1))
    phases = [np.interp(np.r_[0.25, 0.7], (GRID + s * np.sin(2 * np.pi * GRID)), GRID) for s in shifts[:, 0]]
    values = np.stack([bumps(GRID + s * np.sin(2 * np.pi * GRID)) for s in shifts[:, 0]])[..., None]
    return values, np.array(phases)


def test_events_come_to_common_phases():
    values, phases = made(np.random.default_rng(0))
    found = register(values, phases, [0.25, 0.7])
    peaks = found.values[:, : P // 2, 0].argmax(axis=1), P // 2 + found.values[:, P // 2 :, 0].argmax(axis=1)
    np.testing.assert_allclose(np.array(peaks) / P, [[0.25] * 12, [0.7] * 12], atol=1.01 / P)
    assert (np.diff(found.warps, axis=1) > 0).all()
    # The warp joins smoothly: its slope at the end of a cycle is that at its beginning.
    step = np.diff(np.c_[found.warps, found.warps[:, :1] + 1, found.warps[:, 1:2] + 1], axis=1)
    np.testing.assert_allclose(step[:, -2], step[:, -1], atol=0.004)


def test_the_variance_of_shape_falls_and_that_of_timing_is_kept():
    values, phases = made(np.random.default_rng(1))
    found = register(values, phases)
    assert found.values.var(axis=0).sum() < 0.1 * values.var(axis=0).sum()
    np.testing.assert_allclose(found.timing, found.warps - GRID)
    # What is left of the timing at the events is the events' own spread.
    spread = [np.std([np.interp(at, GRID, row) for row in found.warps]) for at in phases.mean(axis=0)]
    np.testing.assert_allclose(spread, phases.std(axis=0), rtol=0.02)


def test_events_at_their_places_change_nothing():
    values, _ = made(np.random.default_rng(2), 3)
    np.testing.assert_allclose(register(values, np.tile([0.1, 0.6], (3, 1))).values, values, atol=1e-12)


def test_gaps_stay_gaps_and_cycles_keep_their_labels():
    values, phases = made(np.random.default_rng(3))
    values[0, 40:50] = np.nan
    cycles = Cycles(values, ("knee",), np.ones(12), np.arange(12), tuple("abcdefghijkl"))
    found = register(cycles, phases)
    assert 8 <= np.isnan(found.values[0]).sum() <= 14
    assert np.isfinite(found.values[1:]).all()
    assert found.of(cycles).subject == cycles.subject


@pytest.mark.parametrize(
    ("events", "targets", "says"),
    [
        (np.zeros((2, 1)), None, r"of 3 cycles, got \(2, 1\)"),
        (np.full((3, 1), np.nan), None, "events must be finite"),
        ([[0.5, 0.2]] * 3, None, "events must be finite and rise"),
        ([[0.2, 0.5]] * 3, [0.2, 1.3], "targets must be finite and rise"),
        ([[0.2, 0.5]] * 3, [0.2], "targets must be finite and rise"),
    ],
)
def test_wrong_events_are_told(events, targets, says):
    with pytest.raises(MotionError, match=says):
        register(np.zeros((3, 16, 1)), events, targets)
