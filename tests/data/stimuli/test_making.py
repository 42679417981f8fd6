"""Sets of stimuli: the same pixels each time, dots where the table says, and a file that makes them again."""

import csv
import hashlib
import io
import json
import zipfile

import av
import numpy as np
import pytest
from PIL import Image

from motionenv.data.stimuli import Display, PointLightWalker, StimulusSet, frames_of, write_stimuli, zipped
from motionenv.data.stimuli.making import ring
from motionenv.errors import MotionError

SMALL = StimulusSet(
    people=(PointLightWalker(), PointLightWalker(model="walk/eigenwalkers", deviations=(2.0,), speed=1.7, height=1.6)),
    displays=(Display(view=90), Display(mask=20, dots=9, lifetime=0.2, seed=3, inverted=True)),
    seconds=0.4, fps=30, width=160, height=120,
)  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of a set as films."""
    told = write_stimuli(SMALL, tmp_path_factory.mktemp("made") / "set")
    return told.parent


def test_every_stimulus_has_a_film_and_a_table(made):
    names = [f"person-{i:03d}-display-{j:03d}" for i in (1, 2) for j in (1, 2)]
    files = [f"{name}{suffix}" for name in names for suffix in (".csv", ".mp4")]
    assert sorted(p.name for p in made.iterdir()) == sorted([*files, "stimuli.json"])
    for name in names:
        with av.open(str(made / f"{name}.mp4")) as film:
            assert sum(1 for _ in film.decode(video=0)) == 12
    told = json.loads((made / "stimuli.json").read_text())
    assert [one["name"] for one in told["stimuli"]] == names
    second = told["stimuli"][2]
    assert second["stride"] / second["cycle_seconds"] == pytest.approx(1.7)
    assert second["body_height"] == 1.6


def test_its_file_makes_the_same_pixels_again(made):
    again = StimulusSet.read(made / "stimuli.json")
    told = json.loads((made / "stimuli.json").read_text())["stimuli"]
    for one in told:
        digest = hashlib.sha256()
        for frame in frames_of(again, again.people[one["person"]], again.displays[one["display"]]):
            digest.update(frame.tobytes())
        assert digest.hexdigest() == one["sha256_of_pixels"]
    assert b"".join(zipped(SMALL)) == b"".join(zipped(SMALL))


def test_frames_show_dots_where_the_table_says(tmp_path):
    asked = SMALL.model_copy(update={"format": "png"})
    write_stimuli(asked, tmp_path / "set")
    with (tmp_path / "set" / "person-001-display-001.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["seconds"] == "0.200000"]
    assert len(rows) == 15
    frame = np.asarray(Image.open(tmp_path / "set" / "person-001-display-001" / "000006.png"))
    assert frame.shape == (120, 160, 3)
    for row in rows:
        assert frame[round(float(row["y"])), round(float(row["x"]))].min() > 60
    wanted = list(frames_of(asked, asked.people[0], asked.displays[0]))
    np.testing.assert_array_equal(frame, wanted[6])
    lit = (frame[..., 0] / 255).sum()
    radius = 0.5 * 0.034 * 0.7 * 120
    assert 6 * np.pi * radius**2 < lit <= 15.5 * np.pi * radius**2, "fifteen discs, of which some overlap"


def test_an_archive_holds_what_the_folder_does(made):
    with zipfile.ZipFile(io.BytesIO(b"".join(zipped(SMALL)))) as archive:
        assert archive.testzip() is None
        assert sorted(archive.namelist()) == sorted(p.name for p in made.iterdir())
        for name in archive.namelist():
            assert archive.read(name) == (made / name).read_bytes(), name


def test_who_cannot_walk_in_place_is_refused(tmp_path):
    with pytest.raises(MotionError, match="makes no cycles in place"):
        ring(PointLightWalker(model="mixed/tree"))
    with pytest.raises(MotionError, match="deviations"):
        ring(PointLightWalker(deviations=(0.0,) * 60))
    (tmp_path / "other").write_text("")
    with pytest.raises(MotionError, match="must be a new or an empty folder"):
        write_stimuli(SMALL, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["other"]


def test_a_set_that_fails_leaves_nothing(tmp_path):
    def stop(done: int) -> None:
        if done > 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_stimuli(SMALL, tmp_path / "set", step=stop)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(MotionError, match="can't write"):
        write_stimuli(SMALL, tmp_path / "nowhere" / "set")
    (tmp_path / "empty").mkdir()
    assert write_stimuli(SMALL, tmp_path / "empty").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["empty"]
