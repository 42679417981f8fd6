"""The loops of the exact sampler: its exponential against NumPy's, its tree of boxes against brute force."""

import numpy as np
import pytest

from motionenv.models.motion_tree.search.kernel_index_kernels import (
    BLOCK,
    FAN,
    first_groups,
    kernels,
    reference,
    scratch,
)


def test_the_exponential_is_good_to_four_parts_in_ten_million():
    x = np.linspace(-86.9, 59.9, 16 * 20000).astype(np.float32)
    powers, mass = np.empty(16, np.float32), np.empty((1, 16), np.float32)
    worst = 0.0
    for row in x.reshape(-1, 16):
        total = kernels(-row.copy(), np.float32(1), np.float32(1), powers, powers.view(np.int32), mass, 0)
        exact = np.exp(row.astype(np.float64))
        worst = max(worst, np.abs(mass[0] / exact - 1).max(), abs(total / exact.sum() - 1))
    assert worst < 4e-7


@pytest.mark.parametrize("n", [1, 16, 17, 256, 257, 4096, 4097, 70_000])
def test_groups_of_sixteen_lead_to_one_root(n):
    levels, first = first_groups(n)
    counts = [-(-n // FAN ** (level + 2)) for level in range(levels)]
    assert counts[-1] == 1
    assert all(count > 1 for count in counts[:-1])
    assert [int(first[level]) for level in range(levels)] == [sum(counts[level + 1 :]) for level in range(levels)]
    assert first[levels] == sum(counts)
    mass, child, *_ = scratch(n, 8)
    assert mass.shape == child.shape == (sum(counts) + -(-n // FAN), FAN)


@pytest.mark.parametrize("steepness", [1.0, 100.0, 1e5])
def test_no_kernel_is_more_than_e_to_60_times_the_references(steepness):
    """Boxes built by hand of 40 points on a plane: one group above three leaves."""
    rng = np.random.default_rng(3)
    z = rng.normal(size=(40, 2)).astype(np.float32)
    padded = np.full((2 * BLOCK, 2), np.inf, np.float32)
    padded[:40] = z
    blocks = np.ascontiguousarray(padded.reshape(2, BLOCK, 2).transpose(0, 2, 1))
    boxes = np.full((1, 2, FAN, 8), np.inf, np.float32)
    for leaf in range(3):
        points = z[FAN * leaf : FAN * (leaf + 1)]
        boxes[0, :, leaf] = 0.0
        boxes[0, 0, leaf, :2], boxes[0, 1, leaf, :2] = points.min(0), points.max(0)
    levels, first = first_groups(40)
    *_, row, _, _, stack, bounds, _ = scratch(40, 8)
    for probe in rng.normal(size=(20, 2)).astype(np.float32):
        padded_probe = np.zeros(8, np.float32)
        padded_probe[:2] = probe
        best, far = reference(blocks, boxes, levels, first, padded_probe, steepness, row, stack, bounds)
        least = ((z.astype(np.float64) - probe) ** 2).sum(1).min()
        assert -1e-6 < steepness * (best - least) <= 60
        assert not far or steepness * best > 60
