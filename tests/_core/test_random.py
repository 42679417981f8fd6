"""Random numbers of kernels: SplitMix64 as it is published, and distributions against SciPy's."""

import numpy as np
import pytest
from scipy.stats import kstest, norm

from motionenv._core.random import gaussian, key_of, normal, restart, stream, uniform

#: What SplitMix64 gives for the seed 1234567, as published: https://rosettacode.org/wiki/Pseudo-random_numbers/Splitmix64
PUBLISHED = [
    6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821
]  # fmt: skip


def drawn(draw, key: int, number: int, n: int = 20_000) -> np.ndarray:
    state = stream(np.uint64(key), np.uint64(number))
    return np.array([draw(state) for _ in range(n)])


def test_numbers_are_the_upper_53_bits_of_splitmix64():
    state = np.array([1234567], dtype=np.uint64)
    assert [uniform(state) for _ in PUBLISHED] == [(bits >> 11) / 2**53 for bits in PUBLISHED]


def test_a_stream_begins_again_where_it_began():
    state = stream(np.uint64(7), np.uint64(3))
    first = [uniform(state) for _ in range(5)]
    restart(state, np.uint64(7), np.uint64(3))
    assert [uniform(state) for _ in range(5)] == first


def test_streams_of_neighbours_have_nothing_to_do_with_each_other():
    """Keys, numbers and draws that differ by one, as those of frames and particles do."""
    keys = [(7, 0), (7, 1), (8, 0), (8, 1), *((int(key_of(np.uint64(7), np.uint64(j))), 0) for j in (1, 2))]
    found = np.array([drawn(uniform, *key) for key in keys])
    assert np.abs(np.corrcoef(found) - np.eye(len(keys))).max() < 4 / np.sqrt(found.shape[1])
    firsts = np.array([uniform(stream(np.uint64(5), np.uint64(i))) for i in range(5000)])
    assert kstest(firsts, "uniform").pvalue > 0.01
    assert key_of(np.uint64(7), np.uint64(0)) == 7


@pytest.mark.parametrize(("draw", "distribution"), [(uniform, "uniform"), (normal, "norm"), (gaussian, "norm")])
def test_draws_are_of_their_distribution(draw, distribution):
    assert kstest(drawn(draw, 3, 4), distribution).pvalue > 0.01


def test_the_ziggurat_draws_standard_normals():
    state = stream(1, 2)
    drawn = np.array([gaussian(state) for _ in range(100_000)])
    assert kstest(drawn, "norm").pvalue > 0.01
    assert (np.abs(drawn) > 3.7).mean() == pytest.approx(2 * norm.sf(3.7), rel=0.5)
    assert np.mean(drawn**4) == pytest.approx(3.0, abs=0.1)
