"""Tables of walks, in memory and in files, against numpy on one array."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from motionenv.errors import GapError, MotionError
from motionenv.models.eigenwalkers import table
from motionenv.models.eigenwalkers.fourier_series import FourierWalker, later, mirrored
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.table import COEFFICIENTS, Columns, each, mean_walkers, read_walks
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from tests.models.eigenwalkers.walks import hide


@pytest.fixture(params=[2**26, 20_000], ids=["memory", "files"])
def small(request, monkeypatch):
    """Blocks of three walkers; tables in memory, or in files from the eleventh walker on."""
    monkeypatch.setattr(table, "MOST", request.param)
    monkeypatch.setattr(table, "BLOCK", 3 * 1800)
    monkeypatch.setattr(table, "_AT_A_TIME", 5)
    return request.param


def all_of(rows) -> np.ndarray:
    return np.concatenate(list(rows.blocks()))


def test_rows_are_those_of_one_array(walkers, small, tmp_path):
    read = read_walks(iter(walkers), None, tmp_path)
    w = np.stack([walker.coefficients for walker in walkers])
    assert (len(list(tmp_path.iterdir())) > 0) == (small < 2**26)
    np.testing.assert_array_equal(all_of(read.rows), w)
    np.testing.assert_array_equal(read.frequencies, [walker.frequency for walker in walkers])
    some = np.array([0, 1, 2, 6, 8])
    both = read.rows.take(some).with_mirror_images()
    expected = np.concatenate([w[some], mirrored(w[some])])
    assert len(both) == 10
    np.testing.assert_array_equal(all_of(both), expected)
    shown = np.arange(225) % 7 > 0
    columns = Columns(both, shown)
    assert columns.shape == (10, shown.sum(), 1)
    for part in (slice(None), slice(3, 8), slice(0, None, 3), slice(4, 4)):
        np.testing.assert_array_equal(columns[part][..., 0], expected[part].reshape(-1, 225)[:, shown])
    numbers = np.arange(len(w))
    found = list(each(lambda block, who: (len(block), who), read.rows, numbers))
    np.testing.assert_array_equal(np.concatenate([who for _, who in found]), numbers)
    assert max(size for size, _ in found) == 3


def test_threads_read_the_same(walkers, tmp_path):
    with ThreadPoolExecutor(2) as pool:
        read = read_walks(walkers, None, tmp_path, pool)
    np.testing.assert_array_equal(all_of(read.rows), [walker.coefficients for walker in walkers])


@pytest.mark.parametrize("order", ["together", "mixed"])
def test_a_persons_mean_is_that_of_what_is_known(walkers, small, order, tmp_path):
    some = [hide(w, [7]) if i % 3 == 0 else w for i, w in enumerate(walkers[:14])]
    labels = [str(i // 5 if order == "together" else i % 4) for i in range(14)]
    found = mean_walkers(read_walks(some, labels, tmp_path), labels, tmp_path)
    assert found.people == tuple(dict.fromkeys(labels))
    for label, mean, frequency in zip(found.people, all_of(found.rows), found.frequencies, strict=True):
        mine = [w for w, own in zip(some, labels, strict=True) if own == label]
        np.testing.assert_allclose(frequency, np.exp(np.mean([np.log(w.frequency) for w in mine])))
        known = np.nanmean([w.coefficients for w in mine], axis=0)
        np.testing.assert_allclose(np.abs(mean).sum(), np.abs(known).sum(), rtol=0.05)
        np.testing.assert_allclose(mean[0, :, 2], known[0, :, 2], atol=1e-12)


def test_a_mean_does_not_depend_on_the_phase_in_which_walks_come(walkers, tmp_path):
    one, other = walkers[:2]
    shifted = FourierWalker(later(one.coefficients, 2.0), 0.8)
    read = read_walks([shifted, hide(shifted, [7])], ["a", "a"], tmp_path)
    np.testing.assert_allclose(all_of(mean_walkers(read, "aa", tmp_path).rows)[0], one.coefficients, atol=1e-9)
    read = read_walks([one, hide(other, [7]), other], ["b", "b", "a"], tmp_path)
    found = mean_walkers(read, read.people, tmp_path)
    assert found.people == ("b", "a")
    np.testing.assert_allclose(all_of(found.rows)[0, 3:, 7], one.coefficients[3:, 7], atol=0.01)


@pytest.mark.parametrize("gaps", [False, True], ids=["whole", "gaps"])
@pytest.mark.parametrize("kind", [Eigenwalkers, WalkerPrior])
def test_models_are_the_same_whatever_the_blocks(walkers, small, kind, gaps, monkeypatch):
    walks = [hide(w, [5, 7]) if gaps and i % 3 == 0 else w for i, w in enumerate(walkers)]
    labels = [str(i // 2) for i in range(len(walks))]
    found = kind(3).fit(iter(walks), labels).to_arrays()[0]
    monkeypatch.undo()
    expected = kind(3).fit(walks, labels).to_arrays()[0]
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=0, atol=1e-9 * np.abs(value).max(), err_msg=name)


def test_walks_get_labels_of_their_own_unless_told(walkers, tmp_path):
    assert read_walks(walkers[:3], None, tmp_path).people == ("0", "1", "2")
    with pytest.raises(MotionError, match="a subject for each walk, got 3 walks and 2 subjects"):
        read_walks(walkers[:3], ["a", "b"], tmp_path)


def test_a_person_without_an_ankle_is_refused(walkers, tmp_path):
    read = read_walks([hide(walkers[0], [13, 14])], None, tmp_path)
    with pytest.raises(GapError, match="too few frames show either ankle"):
        mean_walkers(read, read.people, tmp_path)
    assert all_of(read.rows).shape == (1, *COEFFICIENTS)


@pytest.mark.parametrize("kind", [Eigenwalkers, WalkerPrior])
def test_nobody_is_no_crowd(kind):
    with pytest.raises(MotionError, match="fit needs walks of several people, got none"):
        kind().fit(iter([]))
