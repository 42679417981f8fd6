"""Work that threads share: each piece done once, errors come out."""

import threading

import pytest

from motionenv.render._workers import Workers


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
