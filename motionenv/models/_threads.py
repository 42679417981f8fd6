"""Cycles in chunks for threads; chunks depend on the number of cycles only, so results don't on the machine."""

import os
from concurrent.futures import ThreadPoolExecutor

CHUNK = 500  # cycles


def chunks(k: int, least: int = CHUNK) -> list[tuple[int, int]]:
    """Bounds (start, stop) of equal chunks of at least `least` of `k` cycles, at most 8."""
    n = max(1, min(8, k // least))
    return [(i * k // n, (i + 1) * k // n) for i in range(n)]


def in_chunks(work, k: int, least: int = CHUNK) -> list:
    """[work(start, stop) of each chunk of `k` cycles], in order, in as many threads as there are cores.

    Args:
        work: what to call.
        k: how many there are.
        least: of a chunk, where one of the `k` takes longer than a cycle does.
    """
    spans = chunks(k, least)
    if len(spans) == 1:
        return [work(*spans[0])]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda span: work(*span), spans))
