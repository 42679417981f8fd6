"""Problems name the field, its bound and what to do, and never what was sent."""

import pytest


@pytest.mark.parametrize(
    ("body", "field", "status"),
    [
        (b'{"seed": false}', "/seed", 422),
        (b'{"fps": NaN}', "/fps", 422),
        (b'{"fps": 1e999}', "/fps", 422),
        (b'{"seconds": -1e9}', "/seconds", 422),
        (b'{"model": "\\ud800"}', None, 400),
        (b'{"model": "no/such"}', "/model", 404),
        (b'{"unheard": 1}', "/unheard", 422),
        (b"[" * 5000, None, 400),
        (b"{", None, 400),
        (b"\xff\xfe", None, 400),
    ],
)
def test_what_is_wrong_is_told_by_field(server, body, field, status):
    answer = server.http.post("/v1/synthesis", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == status
    assert field is None or field in [error["field"] for error in problem["errors"]]


@pytest.mark.parametrize("path", ["/v1/synthesis", "/v1/jobs/render"])
def test_the_bound_of_a_product_is_what_its_field_may_be(server, path):
    long, large = {"seconds": 3000, "fps": 30}, {"seconds": 1, "picture": {"width": 4000, "height": 1000}}
    for asked, field, bound in ((long, "/seconds", 1200.0), (large, "/picture/width", 2073.6)):
        problem = server.http.post(path, json=asked, headers={"Accept": "video/mp4, application/problem+json"}).json()
        assert [(e["field"], e["bound"]) for e in problem["errors"]] == [(field, {"le": bound})]


def test_a_bound_is_told_as_a_number(server):
    problem = server.http.post("/v1/synthesis", json={"fps": 1000}).json()
    assert problem["errors"][0]["bound"] == {"le": 240.0}


def test_a_long_path_is_not_sent_back_whole(server):
    answer = server.http.get(f"/{'x' * 30_000}")
    assert (answer.status_code, len(answer.content) < 400) == (404, True)
