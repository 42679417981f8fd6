"""Sixty cycles with gaps."""

import pytest

from tests.models.fpca.made_cycles import low_rank, with_gaps


@pytest.fixture(scope="package")
def gappy():
    truth, components = low_rank()
    values, hidden = with_gaps(truth)
    return truth, components, values, hidden
