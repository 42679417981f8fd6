"""Servers that the tests of data sets share."""

from collections.abc import Iterator

import pytest

from tests.data.s3 import s3_server


@pytest.fixture(scope="session")
def s3() -> Iterator[int]:
    """Port of an S3 server."""
    with s3_server() as port:
        yield port
