import itertools
import pickle

import numpy as np
import pytest

from motionenv.data import Sampler, Walkers
from motionenv.data.stream import stacked
from motionenv.errors import MotionError
from tests.data.walks import SINGLE, same

WANTED = list(Sampler(SINGLE).samples(0, 50))


def test_a_sequence_a_stream_and_batches_give_the_same_samples():
    walkers = Walkers(SINGLE)
    assert len(walkers) == 50
    assert all(same(walkers[k], WANTED[k]) for k in (0, 31, 49))
    assert same(walkers[-1], WANTED[-1])
    assert all(same(one, other) for one, other in zip(walkers, WANTED, strict=True))
    batches = list(walkers.stream(batch=16))
    assert [len(batch["index"]) for batch in batches] == [16, 16, 16, 2]
    assert same(batches[1], stacked(WANTED[16:32]))
    assert all(same(a, b) for a, b in zip(pickle.loads(pickle.dumps(walkers)).stream(), WANTED, strict=True))
    with pytest.raises(IndexError, match="index must be from 0 to 49, got 50"):
        walkers[50]


@pytest.mark.parametrize("world", [1, 3, 7, 60])
def test_shares_do_not_overlap_and_are_all(world):
    shares = [[int(s["index"]) for s in Walkers(SINGLE).stream(rank=rank, world=world)] for rank in range(world)]
    assert list(itertools.chain(*shares)) == list(range(50))
    assert max(map(len, shares)) - min(map(len, shares)) <= 1


@pytest.mark.parametrize("batch", [None, 4])
def test_a_stream_goes_on_where_another_ended(batch):
    how = {"batch": batch, "rank": 1, "world": 3}
    whole = list(Walkers(SINGLE).stream(**how))
    after = list(Walkers(SINGLE).stream(**how, start=2))
    assert all(same(a, b) for a, b in zip(after, whole[2:], strict=True))
    assert not list(Walkers(SINGLE).stream(**how, start=100))


def test_ranks_are_checked():
    with pytest.raises(MotionError, match="rank must be a whole number from 0 to 1, got 2"):
        Walkers(SINGLE).stream(rank=2, world=2)
    assert isinstance(WANTED[0]["index"], np.ndarray)
