"""What the tests of the client share."""

import pytest

import motionenv


@pytest.fixture(scope="module")
def client(server):
    with motionenv.Client(server.url, patience=90) as client:
        yield client
