"""Real walks, stride times and occlusions."""

import pytest

from benchmarks.captured_walks import Walk, read_cmu, read_santos, remove_blocks, stride_time


@pytest.fixture(scope="session")
def cmu_walks(mocap) -> list[Walk]:
    """See `read_cmu`."""
    return read_cmu(mocap)


@pytest.fixture(scope="session")
def santos_walks(mocap) -> list[Walk]:
    """See `read_santos`."""
    return read_santos(mocap)


@pytest.fixture(scope="session")
def events():
    """See `stride_time`."""
    return stride_time


@pytest.fixture(scope="session")
def occlude():
    """See `remove_blocks`."""
    return remove_blocks
