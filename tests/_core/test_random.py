"""Random numbers of kernels: SplitMix64 as it is published, and distributions against SciPy's."""

import numpy as np
import pytest
from scipy.stats import kstest, norm

from motionenv._core.compilation import kernel
from motionenv._core.random import gaussian, key_of, restart, uniform

#: What SplitMix64 gives for the seed 1234567, as published: https://rosettacode.org/wiki/Pseudo-random_numbers/Splitmix64
PUBLISHED = [
    6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821
]  # fmt: skip


@kernel
def fill_uniform(state, values):
    for i in range(len(values)):
        values[i] = uniform(state)


@kernel
def fill_gaussian(state, values):
    for i in range(len(values)):
        values[i] = gaussian(state)


@kernel
def begin(state, key, number):
    restart(state, key, number)


def begun(key: int, number: int) -> np.ndarray:
    state = np.empty(1, dtype=np.uint64)
    begin(state, np.uint64(key), np.uint64(number))
    return state


@kernel
def key(first, draw):
    return key_of(first, draw)


def drawn(fill, state, n: int = 20_000) -> np.ndarray:
    values = np.empty(n)
    fill(state, values)
    return values


def test_numbers_are_the_upper_53_bits_of_splitmix64():
    state = np.array([1234567], dtype=np.uint64)
    assert drawn(fill_uniform, state, 5).tolist() == [(bits >> 11) / 2**53 for bits in PUBLISHED]


def test_a_stream_begins_again_where_it_began():
    state = begun(7, 3)
    first = drawn(fill_uniform, state, 5)
    begin(state, np.uint64(7), np.uint64(3))
    np.testing.assert_array_equal(drawn(fill_uniform, state, 5), first)


def test_streams_of_neighbours_have_nothing_to_do_with_each_other():
    """Keys, numbers and draws that differ by one, as those of frames and particles do."""
    keys = [(7, 0), (7, 1), (8, 0), (8, 1), *((int(key(np.uint64(7), np.uint64(j))), 0) for j in (1, 2))]
    found = np.array([drawn(fill_uniform, begun(a, b)) for a, b in keys])
    assert np.abs(np.corrcoef(found) - np.eye(len(keys))).max() < 4 / np.sqrt(found.shape[1])
    firsts = np.array([drawn(fill_uniform, begun(5, i), 1)[0] for i in range(5000)])
    assert kstest(firsts, "uniform").pvalue > 0.01
    assert key(np.uint64(7), np.uint64(0)) == 7


@pytest.mark.parametrize(("fill", "distribution"), [(fill_uniform, "uniform"), (fill_gaussian, "norm")])
def test_draws_are_of_their_distribution(fill, distribution):
    assert kstest(drawn(fill, begun(3, 4)), distribution).pvalue > 0.01


def test_the_ziggurat_has_the_tails_of_a_normal_distribution():
    values = drawn(fill_gaussian, begun(1, 2), 100_000)
    assert (np.abs(values) > 3.7).mean() == pytest.approx(2 * norm.sf(3.7), rel=0.5)
    assert np.mean(values**4) == pytest.approx(3.0, abs=0.1)
