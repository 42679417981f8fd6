"""Bodies that are JSON, and those that are not."""

import pytest


@pytest.mark.parametrize("kind", ["application/json", "Application/JSON", "application/x+json", "text/plain"])
def test_json_by_any_name_is_as_short_as_json(locked, kind):
    answer = locked.http.post("/v1/synthesis", content=b" " * 2001, headers={"Content-Type": kind})
    assert answer.status_code == 413
