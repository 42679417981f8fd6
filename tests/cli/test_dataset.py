"""The dataset commands and stimuli as people type them."""

import json

import numpy as np
from PIL import Image

from motionenv.data import PRESETS, Specification
from tests.data.walks import EVERYTHING


def test_presets_are_listed_and_printed_for_editing(run, tmp_path):
    listed = run("dataset", "presets")
    assert [line.split()[0] for line in listed.out.splitlines()] == list(PRESETS)
    (tmp_path / "mine.toml").write_text(run("dataset", "presets", "lifting").out)
    assert Specification.read(tmp_path / "mine.toml") == Specification.read("lifting")
    assert json.loads(run("dataset", "schema").out)["title"] == "Specification"
    assert "there is no preset 'walks'" in run("dataset", "presets", "walks").err


def test_preview_make_and_verify(run, tmp_path):
    (tmp_path / "spec.json").write_text(EVERYTHING.json())
    seen = run("dataset", "preview", "spec.json", "--frames", "1e5", "--out", "sheet.png", "--samples", 4)
    assert seen.code == 0
    assert "the first of 16,667 samples" in seen.out
    assert np.asarray(Image.open(tmp_path / "sheet.png")).ndim == 3
    made = run("dataset", "make", "spec.json", "--out", "set", "--workers", 1, "--shards", "0:2")
    assert made.code == 0
    assert "36 frames in 2 shards" in made.out
    assert "1 of 3 are missing" in made.out
    assert run("dataset", "verify", "set").code == 3
    assert "0 of 3 are missing" in run("dataset", "make", "spec.json", "--out", "set", "--workers", 1).out
    assert run("dataset", "verify", "set").code == 0
    refused = run("dataset", "make", "spec.json", "--out", "set", "--seed", 3)
    assert refused.code == 2
    assert "set has another data set: seed differ(s)" in refused.err


def test_options_are_checked_in_the_command_s_words(run):
    for args, told in (
        (("--shards", "5"), "--shards must be FIRST:STOP, such as 0:100, got '5'"),
        (("--shards", "9:"), "--shards 9: has none of the data set's"),
        (("--frames", "many"), "--frames must be a whole number from 1, such as 5000 or 1e6, got 'many'"),
        (("--format", "csv"), "format must be one of"),
    ):
        ended = run("dataset", "make", "lifting", "--frames", "600", "--out", "set", *args)
        assert ended.code == 2
        assert told in ended.err


def test_a_set_is_made_and_made_again(run, tmp_path):
    (tmp_path / "set.toml").write_text("seconds = 0.2\nwidth = 64\nheight = 64\n[[displays]]\nview = 45\n")
    done = run("stimuli", "set.toml", "--out", "one")
    assert "1 stimuli of 12 frames" in done.out
    run("stimuli", "one/stimuli.json", "--out", "two")
    told = [json.loads((tmp_path / name / "stimuli.json").read_text()) for name in ("one", "two")]
    assert told[0] == told[1]
    again = run("stimuli", "set.toml", "--out", "one")
    assert again.code == 2
    assert "new or an empty folder" in again.err


def test_parts_before_one_s_own_photographs(run, tmp_path):
    rng = np.random.default_rng(0)
    (tmp_path / "photos").mkdir()
    for k, colour in enumerate([(200, 0, 0), (0, 0, 200)]):
        picture = np.clip(np.array(colour) + rng.integers(0, 40, (90, 130, 3)), 0, 255).astype(np.uint8)
        Image.fromarray(picture).save(tmp_path / "photos" / f"{k}.jpg")
    (tmp_path / "own.toml").write_text(
        'frames = 40\n[pictures]\nwidth = 48\nheight = 32\n[output]\nfields = ["rgb", "people", "pixels", '
        '"visibility", "face"]\n'
    )
    how = ("--split", "0.75,0.25", "--backgrounds", "photos", "--format", "coco", "--workers", "1")
    assert run("dataset", "make", "own.toml", *how, "--out", "set").code == 0
    people = {}
    for part, frames in (("train", 30), ("validation", 10)):
        told = json.loads((tmp_path / "set" / part / "annotations" / "person_keypoints.json").read_text())
        assert len(told["images"]) == frames
        people[part] = {one["walker"] for one in told["annotations"]}
        picture = np.asarray(Image.open(tmp_path / "set" / part / told["images"][0]["file_name"]))
        corners = picture[[0, 0, -1, -1], [0, -1, 0, -1]].astype(int)
        assert (np.abs(corners[:, 0] - corners[:, 2]) > 40).all()  # red or blue
    assert not people["train"] & people["validation"]
    assert "shares must be" in run("dataset", "make", "own.toml", "--split", "0.9,0.9", "--out", "no").err
    refused = run("dataset", "make", "own.toml", "--backgrounds", "nowhere", "--workers", "1", "--out", "no")
    assert refused.code == 2
    assert not (tmp_path / "no").exists()
    assert "background must be plain, clutter or a folder of photographs (.jpg" in refused.err
