"""Fits of cycles block by block, wherever the cycles are and whoever computes, against the fit in one piece."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from motionenv.cycles import StoredCycles
from motionenv.models.fpca import FunctionalPCA
from motionenv.models.storage import blocks
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps

CHANNELS = 3


@pytest.fixture(scope="module")
def values():
    return with_gaps(low_rank(1100, 32, CHANNELS, 2, noise=0.3)[0], 0.3)[0]


@pytest.fixture(scope="module")
def stored(values, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cycles")
    for i, part in enumerate(np.split(values, [17, 900])):
        np.save(folder / f"{i}.npy", part)
    return StoredCycles(sorted(folder.glob("*.npy")), as_cycles(values).channels, as_cycles(values).subject)


def same(found, expected, tolerance=0.0):
    for name in ("mean_", "components_", "explained_variance_", "noise_variance_", "scores_", "residual_spectrum_"):
        a, b = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * np.abs(b).max(), err_msg=name)


def test_parts_are_all_cycles_once():
    for shape in ((0, 4, 2), (1, 4, 2), (blocks.BLOCK // 64 * 2 + 1, 4, 2), (3, 2**12, 2**12)):
        found = blocks.block_slices(shape)
        assert [i for part in found for i in range(part.start, part.stop)] == list(range(shape[0]))
        assert all((p.stop - p.start) * 8 * shape[1] * shape[2] <= blocks.BLOCK for p in found if p.stop - p.start > 1)


@pytest.mark.parametrize("method", ["ppca", "svd"])
@pytest.mark.parametrize("centre", ["all", "subject"])
def test_blocks_of_any_size_give_the_same_model(values, method, centre, monkeypatch):
    asked = {"n_components": 2, "n_harmonics": 6, "method": method, "centre": centre}
    whole = FunctionalPCA(**asked).fit(as_cycles(values))
    for size in (1, 40, 333):
        monkeypatch.setattr(blocks, "BLOCK", size * 8 * 32 * CHANNELS)
        found = FunctionalPCA(**asked).fit(as_cycles(values))
        same(found, whole, 1e-9)
        np.testing.assert_allclose(found.imputed_, whole.imputed_, atol=1e-9)


@pytest.mark.parametrize("method", ["ppca", "svd"])
def test_files_and_workers_give_the_same_bits_as_memory(values, stored, method, monkeypatch):
    monkeypatch.setattr(blocks, "BLOCK", 100 * 8 * 32 * CHANNELS)
    asked = {"n_components": 2, "n_harmonics": 6, "method": method}
    memory = FunctionalPCA(**asked).fit(as_cycles(values))
    same(FunctionalPCA(**asked).fit(stored), memory)
    with ThreadPoolExecutor(3) as threads:
        same(FunctionalPCA(**asked).fit(as_cycles(values), executor=threads), memory)
        same(FunctionalPCA(**asked).fit(stored, executor=threads), memory)
    np.testing.assert_array_equal(FunctionalPCA(**asked).fit(stored).imputed_, memory.imputed_)


def test_processes_read_the_files_themselves(values, stored):
    asked = {"n_components": 2, "n_harmonics": 6, "max_iter": 3}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        same(FunctionalPCA(**asked).fit(stored, executor=pool), FunctionalPCA(**asked).fit(as_cycles(values)))


def test_channels_are_chosen_in_files_too(values, stored):
    names = as_cycles(values).channels
    asked = {"channels": (names[2], names[0])}
    same(FunctionalPCA(2, 6).fit(stored, **asked), FunctionalPCA(2, 6).fit(as_cycles(values), **asked))


def test_what_fails_in_a_worker_is_the_callers_error(stored):
    class Broken(ThreadPoolExecutor):
        def map(self, work, calls):
            raise OSError("no more workers")

    with pytest.raises(OSError, match="no more workers"), Broken(1) as pool:
        FunctionalPCA(2, 6).fit(stored, executor=pool)
