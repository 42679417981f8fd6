"""Parts of results: against slices of the whole, on a real server."""

import pytest

from tests.service.jobs.handing import SHORT, ended, result


@pytest.fixture(scope="module")
def film(job_server):
    """A server, the address of a film that it made, and its bytes."""
    job = ended(job_server, job_server.http.post("/v1/jobs/render", json=SHORT))
    return job_server, job["result"], result(job_server, job).content


def part(film, text, **headers):
    server, address, _ = film
    return server.http.get(address, headers={"Range": text, "Accept-Encoding": "identity", **headers})


@pytest.mark.parametrize(
    ("text", "expected"),
    [("bytes=0-9", slice(0, 10)), ("bytes=100-", slice(100, None)), ("bytes=-7", slice(-7, None)),
     ("bytes=5-999999999", slice(5, None)), ("bytes=0-0", slice(0, 1))],
)  # fmt: skip
def test_a_part_is_what_it_says(film, text, expected):
    whole = film[2]
    answer = part(film, text)
    assert answer.status_code == 206
    assert answer.content == whole[expected]
    first = range(len(whole))[expected].start
    assert answer.headers["content-range"] == f"bytes {first}-{first + len(answer.content) - 1}/{len(whole)}"


@pytest.mark.parametrize("text", ["bytes=9-2", "lines=1-2", "bytes", "bytes=-", "bytes=0-1,3-4", "bytes=a-b", ""])
def test_what_is_no_single_range_is_ignored(film, text):
    answer = part(film, text)
    assert (answer.status_code, answer.content) == (200, film[2])


def test_a_part_that_there_is_not(film):
    answer = part(film, f"bytes={len(film[2])}-")
    assert answer.status_code == 416
    assert answer.headers["content-range"] == f"bytes */{len(film[2])}"
    assert answer.json()["type"] == "/docs#range-not-satisfiable"
    assert part(film, "bytes=-0").status_code == 416


def test_a_part_of_something_else_is_not_sent(film):
    tag = part(film, "bytes=0-1").headers["etag"]
    assert part(film, "bytes=0-1", **{"If-Range": tag}).status_code == 206
    assert part(film, "bytes=0-1", **{"If-Range": '"other"'}).content == film[2]
