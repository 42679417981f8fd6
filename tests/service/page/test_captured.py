"""The points of a capture over its body."""

import numpy as np
import pytest

import motionenv
from tests.service.page.browsing import tab
from tests.service.waiting import until


@pytest.fixture
def walk(tmp_path):
    """A file of the markers of a walk."""
    path = tmp_path / "walk.c3d"
    motionenv.write(motionenv.synthesize("walk/fpca", 4, 30, seed=3), path)
    return path


def test_captured_points_are_where_the_body_is(browser, server, walk):
    seen = tab(browser, server.url).open("model=walk/fpca")
    assert seen.page.is_hidden("#captured")
    seen.page.set_input_files("#capture input[type=file]", walk)
    seen.until("document.querySelector('.capture-actions:not([hidden])')", 120)
    plain = seen.still(0.37).picture("captured-plain")
    seen.page.check("#markers")
    assert seen.still(0.37).picture("captured-points") != plain
    points = np.reshape(seen.ask("[...motionenv.walkers[0].points]"), (-1, 3))
    body = np.reshape(seen.ask("[...motionenv.walkers[0].markers]"), (-1, 3))
    distances = np.linalg.norm(points[:, None] - body, axis=2).min(0)
    assert len(points) == len(motionenv.read(walk).names)
    assert np.median(distances) < 0.01  # the body is fitted to them
    assert distances.max() < 0.05
    seen.until("location.hash.includes('markers=1')")
    other = tab(browser, server.url).open(seen.page.url.split("#")[1])
    other.until("motionenv.guest")
    assert other.page.is_checked("#markers")
    other.still(0.37)
    np.testing.assert_allclose(other.ask("[...motionenv.walkers[0].points]"), points.ravel(), atol=1e-6)
    other.page.click("#leave")  # back to the models
    assert other.page.is_hidden("#captured")
    assert [*seen.complaints, *other.complaints] == []


def test_what_the_service_tells_of_them_is_in_the_file(server, walk):
    held = motionenv.read(walk)
    with walk.open("rb") as file:
        job = server.http.post("/v1/jobs/inspect", files={"files": file}).json()
    until(lambda: server.http.get(f"/v1/jobs/{job['id']}?wait=10").json()["status"] == "done")
    (read,) = server.http.get(f"/v1/jobs/{job['id']}/result").json()["files"]
    assert tuple(read["points"]) == held.names
    np.testing.assert_allclose(np.array(read["motion"]["points"], float), held.positions, atol=6e-5)
