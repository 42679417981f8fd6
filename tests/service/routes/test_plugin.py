"""Another package's model of ten lines is listed by the service, makes motion over HTTP, and moves on the page."""

import os

import numpy as np
import pytest

from tests.models.toy_package import install
from tests.service.page.browsing import tab


@pytest.fixture(scope="module")
def server(serving, tmp_path_factory):
    """A service where the package is installed."""
    folder = install(tmp_path_factory.mktemp("installed"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
        with serving(tmp_path_factory.mktemp("service")) as running:
            yield running


def test_it_is_listed_and_described(server):
    listed = {told["name"]: told for told in server.http.get("/v1/models").json()["models"]}
    assert listed["toy/bounce"]["kind"] == "bounce"
    assert listed["toy/bounce"]["ready"]
    assert listed["toy/bounce"]["licence"] == "CC0"
    told = server.http.get("/v1/models/toy/bounce").json()
    assert (told["components"], told["treadmill"], told["synthesis"]) == ([], None, True)
    assert set(told["ranges"]) == {"speed", "height", "weight", "phase", "variation", "seconds", "fps"}


def test_one_that_is_broken_is_listed_with_its_problem(server):
    listed = {told["name"]: told for told in server.http.get("/v1/models").json()["models"]}
    assert not listed["toy/broken"]["ready"]
    assert "toy_gait_that_is_missing" in listed["toy/broken"]["problem"]
    refused = server.http.post("/v1/synthesis", json={"model": "toy/broken"})
    assert refused.status_code == 503
    assert "toy_gait_that_is_missing" in refused.json()["detail"]
    assert server.http.get("/health/ready").status_code == 200


def test_it_makes_motion_over_http(server):
    asked = {"model": "toy/bounce", "seconds": 1, "fps": 30, "speed": 1.2, "height": 1.6}
    told = server.http.post("/v1/synthesis", json=asked).json()
    assert told["height"] == 1.6
    assert np.array(told["poses"])[-1, 0] == pytest.approx(1.2 * 29 / 30)
    refused = server.http.post("/v1/synthesis", json={**asked, "deviations": [1.0]})
    assert refused.status_code == 422
    assert "no components" in refused.text


def test_it_moves_on_the_page(browser, server):
    page = tab(browser, server.url, walking=True).open("model=walk/fpca")
    page.until("document.querySelector('#models input[value=\"toy/bounce\"]')")
    page.page.click("#models-section summary")
    page.page.check("#models input[value='toy/bounce']", force=True)
    page.until("motionenv.state.model === 'toy/bounce' && motionenv.walkers[0].end > 1", 60)
    assert page.ask("document.getElementById('components-section').hidden")
    heights = np.array(page.ask("motionenv.walkers[0].poses"))[:, 2]
    assert np.ptp(heights) == pytest.approx(1.75 * 0.06, rel=0.05)
    assert page.ask("document.querySelector('#models input[value=\"toy/broken\"]')") is None
    assert page.ask("document.getElementById('note').hidden")
    assert page.complaints == []
