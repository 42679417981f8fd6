"""Fourteen walkers made by hand, and eigenwalkers fitted to them."""

import pytest

from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.model import Eigenwalkers
from tests.models.eigenwalkers.walks import walker


@pytest.fixture(scope="package")
def walkers() -> list[FourierWalker]:
    return [walker(seed) for seed in range(14)]


@pytest.fixture(scope="package")
def model(walkers) -> Eigenwalkers:
    return Eigenwalkers(3).fit(walkers)
