"""Large text is compressed for those who accept it, and nothing else."""

import gzip

import httpx
import pytest

LONG = {"seed": 1, "seconds": 60}


def asked(server, body, accept="application/json", encoding="gzip"):
    headers = {"Accept": accept, "Accept-Encoding": encoding, "Content-Type": "application/json"}
    with httpx.stream("POST", f"{server.url}/v1/synthesis", json=body, headers=headers, timeout=60) as answer:
        return answer.headers, b"".join(answer.iter_raw())


@pytest.mark.parametrize("accept", ["application/json", "text/csv", "model/x-bvh"])
def test_large_text_is_smaller_and_the_same(server, accept):
    plain, whole = asked(server, LONG, accept, encoding="identity")
    packed, body = asked(server, LONG, accept)
    assert "content-encoding" not in plain
    assert packed["content-encoding"] == "gzip"
    assert gzip.decompress(body) == whole
    assert len(body) < 0.6 * len(whole)
    assert packed["etag"] == "W/" + plain["etag"]
    assert "Accept-Encoding" in plain["vary"]
    again = server.http.post("/v1/synthesis", json=LONG, headers={"Accept": accept, "If-None-Match": packed["etag"]})
    assert again.status_code == 304


@pytest.mark.parametrize(
    ("body", "accept"),
    [({"seed": 1, "seconds": 0.1}, "application/json"), (LONG, "application/x-npz"), (LONG, "model/gltf-binary")],
)
def test_what_is_short_or_packed_already_stays(server, body, accept):
    headers, _ = asked(server, body, accept)
    assert "content-encoding" not in headers
    assert not headers["etag"].startswith("W/")
