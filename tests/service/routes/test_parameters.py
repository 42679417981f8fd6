"""`GET /v1/models/…/parameters`: the bytes that the page makes walks of."""

import pytest

import motionenv


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_parameters_are_bytes_that_are_kept(server, model):
    answer = server.http.get(f"/v1/models/{model}/parameters")
    assert answer.status_code == 200
    header = int.from_bytes(answer.content[:4], "little")
    assert (4 + header) % 8 == 0
    arrays, _ = motionenv.models.parameters(motionenv.load(model))
    assert len(answer.content) == 4 + header + 8 * sum(array.size for array in arrays.values())
    again = server.http.get(f"/v1/models/{model}/parameters", headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.parametrize(("model", "status"), [("walk/nobody", 404), ("fitted/nobody", 404), ("Walk/fpca", 422)])
def test_parameters_of_what_there_is_not(server, model, status):
    answer = server.http.get(f"/v1/models/{model}/parameters")
    assert answer.status_code == status
    assert answer.json()["status"] == status
