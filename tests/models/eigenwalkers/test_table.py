"""Tables of walks against numpy."""

import numpy as np
import pytest

from motionenv.errors import GapError, MotionError
from motionenv.models.eigenwalkers.fourier_series import FourierWalker, later, mirrored
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.table import mean_walkers, read_walks, with_mirror_images
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from tests.models.eigenwalkers.walks import hide


def test_rows_are_those_of_the_walks(walkers):
    read = read_walks(iter(walkers), None)
    np.testing.assert_array_equal(read.rows, [walker.coefficients for walker in walkers])
    np.testing.assert_array_equal(read.frequencies, [walker.frequency for walker in walkers])
    both = with_mirror_images(read.rows)
    np.testing.assert_array_equal(both[len(walkers) :], mirrored(read.rows))
    assert len(both) == 2 * len(walkers)


@pytest.mark.parametrize("order", ["together", "mixed"])
def test_a_persons_mean_is_that_of_what_is_known(walkers, order):
    some = [hide(w, [7]) if i % 3 == 0 else w for i, w in enumerate(walkers[:14])]
    labels = [str(i // 5 if order == "together" else i % 4) for i in range(14)]
    found = mean_walkers(read_walks(some, labels), labels)
    assert found.people == tuple(dict.fromkeys(labels))
    for label, mean, frequency in zip(found.people, found.rows, found.frequencies, strict=True):
        mine = [w for w, own in zip(some, labels, strict=True) if own == label]
        np.testing.assert_allclose(frequency, np.exp(np.mean([np.log(w.frequency) for w in mine])))
        known = np.nanmean([w.coefficients for w in mine], axis=0)
        np.testing.assert_allclose(np.abs(mean).sum(), np.abs(known).sum(), rtol=0.05)
        np.testing.assert_allclose(mean[0, :, 2], known[0, :, 2], atol=1e-12)


def test_a_mean_does_not_depend_on_the_phase_in_which_walks_come(walkers):
    one, other = walkers[:2]
    shifted = FourierWalker(later(one.coefficients, 2.0), 0.8)
    read = read_walks([shifted, hide(shifted, [7])], ["a", "a"])
    np.testing.assert_allclose(mean_walkers(read, "aa").rows[0], one.coefficients, atol=1e-9)
    read = read_walks([one, hide(other, [7]), other], ["b", "b", "a"])
    found = mean_walkers(read, read.people)
    assert found.people == ("b", "a")
    np.testing.assert_allclose(found.rows[0, 3:, 7], one.coefficients[3:, 7], atol=0.01)


def test_walks_get_labels_of_their_own_unless_told(walkers):
    assert read_walks(walkers[:3], None).people == ("0", "1", "2")
    with pytest.raises(MotionError, match="a subject for each walk, got 3 walks and 2 subjects"):
        read_walks(walkers[:3], ["a", "b"])


def test_a_person_without_an_ankle_is_refused(walkers):
    read = read_walks([hide(walkers[0], [13, 14])], None)
    with pytest.raises(GapError, match="too few frames show either ankle"):
        mean_walkers(read, read.people)


@pytest.mark.parametrize("kind", [Eigenwalkers, WalkerPrior])
def test_nobody_is_no_crowd(kind):
    with pytest.raises(MotionError, match="fit needs walks of several people, got none"):
        kind().fit(iter([]))
