"""Work that threads share: each piece done once, errors come out."""

import os
import pickle
import threading
import time
from itertools import pairwise

import pytest

from motionenv._core.threads import CHUNK, Workers, in_chunks
from motionenv.errors import MotionError


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("n", [0, 1, 2, 7, 64, 1000])
def test_every_piece_is_done_once(threads, n):
    done, lock = [], threading.Lock()

    def work(start: int, stop: int) -> None:
        with lock:
            done.extend(range(start, stop))

    Workers(threads, "test").share(work, n)
    assert sorted(done) == list(range(n))


def test_an_error_reaches_the_caller_and_the_threads_stay_usable():
    workers = Workers(3, "test")

    def work(start: int, stop: int) -> None:
        if start <= 5 < stop:
            raise ZeroDivisionError("five")

    for _ in range(3):
        with pytest.raises(ZeroDivisionError, match="five"):
            workers.share(work, 24)
    workers.share(lambda start, stop: None, 24)


def test_work_that_shares_work_itself_ends():
    workers, done, lock = Workers(3, "test"), [], threading.Lock()

    def inner(start: int, stop: int) -> None:
        with lock:
            done.extend(range(start, stop))

    workers.share(lambda start, stop: [workers.share(inner, 10) for _ in range(start, stop)], 20)
    assert sorted(done) == sorted([*range(10)] * 20)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system doesn't fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")  # about forking with threads: the case at hand
def test_a_fork_and_a_copy_start_threads_of_their_own():
    """The child has none of the pool's threads, and doesn't wait for them for ever."""
    workers = Workers(3, "test")
    work = lambda start, stop: time.sleep(0.01)
    workers.share(work, 24)
    child = os.fork()
    if child == 0:
        workers.share(work, 24)
        os._exit(7)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    copy = pickle.loads(pickle.dumps(workers))
    copy.share(work, 24)
    assert copy.threads == 3


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "two"])
def test_refuses_what_is_no_number_of_threads(threads):
    with pytest.raises(MotionError, match="threads must be a whole number from 1"):
        Workers(threads, "test")


@pytest.mark.parametrize("k", [0, 1, 499, 1000, 4321, 100_000])
def test_chunks_come_in_order_and_depend_on_their_number_only(k):
    spans = in_chunks(lambda start, stop: (start, stop), k)
    assert spans[0][0] == 0
    assert spans[-1][1] == k
    assert all(one[1] == other[0] for one, other in pairwise(spans))
    assert len(spans) == max(1, min(8, k // CHUNK))
