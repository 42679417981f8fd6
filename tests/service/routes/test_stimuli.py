"""`POST /v1/stimuli` against what Python makes."""

import io
import json
import zipfile

from motionenv.data.stimuli import StimulusSet, zipped
from tests.service.waiting import until

ASKED = {
    "people": [{"deviations": [1.0]}, {"model": "walk/eigenwalkers", "speed": 1.4}],
    "displays": [{"view": 90}, {"mask": 12, "dots": 8, "lifetime": 0.2}],
    "seconds": 0.5, "fps": 24, "width": 128, "height": 128,
}  # fmt: skip


def test_the_archive_is_the_one_that_python_makes(server):
    got = server.http.post("/v1/stimuli", json=ASKED)
    assert got.status_code == 200
    assert got.headers["Content-Type"] == "application/zip"
    assert got.content == b"".join(zipped(StimulusSet.of(ASKED)))
    with zipfile.ZipFile(io.BytesIO(got.content)) as archive:
        told = json.loads(archive.read("stimuli.json"))
    again = server.http.post("/v1/stimuli", json=told["set"], headers={"Accept": "application/zip"})
    assert again.content == got.content
    same = server.http.post("/v1/stimuli", json=ASKED, headers={"If-None-Match": got.headers["ETag"]})
    assert same.status_code == 412


def test_what_is_wrong_is_named(server):
    ready = lambda: all(one["ready"] for one in server.http.get("/v1/models").json()["models"])
    until(ready)
    for change, status, told in (
        ({"people": [{"model": "walk/none"}]}, 404, "walk/none"),
        ({"people": [{"model": "mixed/tree"}]}, 422, "makes no cycles in place"),
        ({"people": [{"model": "/etc/passwd"}]}, 422, "/people/0/model"),
        ({"displays": [{"lifetime": 0.1}]}, 422, "lifetime needs fewer dots"),
        ({"displays": [{"dots": "many"}]}, 422, "/displays/0/dots"),
        ({"seconds": 60, "fps": 60}, 422, "people · displays · seconds · fps"),
        ({"width": 4096, "height": 4096}, 422, "width · height"),
    ):
        got = server.http.post("/v1/stimuli", json=ASKED | change)
        assert (got.status_code, told in got.text) == (status, True), got.text
