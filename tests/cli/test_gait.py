"""`motionenv report`, and what marker maps and standing trials change, on real captures."""

import json
import shutil

import ezc3d
import numpy as np
import pytest

import motionenv
from motionenv.mocap import MarkerMap
from tests.cli.talking import refused


@pytest.fixture
def lab(mocap):
    return mocap / "btkdata" / "C3DSamples"


def test_a_report_of_two_walks_and_a_standing_trial(run, lab, tmp_path):
    walks = [lab / "PiG" / f"PiG_Motion3_{kind}.c3d" for kind in ("FF", "noFF")]
    told = run("report", *walks, "--static", lab / "PiG" / "PiG_Calibration3_FF.c3d", "--out", "r.html")
    assert told.code == 0
    assert "8 strides of flatFoot" in told.out
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert "http" not in page.lower().replace("http-equiv", "")  # nothing is fetched
    figures = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert {capture["name"] for capture in figures["captures"]} == {"PiG_Motion3_FF", "PiG_Motion3_noFF"}
    assert {score["side"] for score in figures["profile"]} == {"left", "right", ""}
    assert (tmp_path / "r.csv").read_text(encoding="utf-8").startswith("kind,name,side,percent,unit,mean")


def test_a_file_that_can_not_be_used_is_left_out_and_told(run, lab, tmp_path):
    (tmp_path / "broken.c3d").write_bytes(b"P")
    told = run("report", lab / "others" / "FunctionalWalk.c3d", "broken.c3d", "--out", "r.html")
    assert told.code == 0
    assert "broken.c3d was left out" in told.err
    refused(run("report", "broken.c3d", "--out", "none.html"), "no file can be analysed")
    assert not (tmp_path / "none.html").exists()


def test_an_age_brings_norms(run, lab, tmp_path):
    walk = lab / "others" / "FunctionalWalk.c3d"
    assert run("report", walk, "--age", "45", "--sex", "male", "--out", "r.html").code == 0
    assert "Step parameters at the age of 45" in (tmp_path / "r.html").read_text(encoding="utf-8")
    refused(run("report", walk, "--sex", "male", "--out", "s.html"), "give age=")
    assert not (tmp_path / "s.html").exists()


def test_a_group_of_ones_own_is_the_band_and_can_be_kept(run, tmp_path):
    (tmp_path / "group").mkdir()
    for person in range(3):
        walk = motionenv.synthesize("walk/fpca", 5, 60, seed=person, speed=1.2)
        motionenv.write(walk, tmp_path / "group" / f"p{person}_1.npz")
    shutil.copy(tmp_path / "group" / "p0_1.npz", tmp_path / "her.npz")
    assert run("report", "her.npz", "--group", "group", "--save-group", "band.json", "--out", "a.html").code == 0
    assert run("report", "her.npz", "--group", "band.json", "--out", "b.html").code == 0
    both = [json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8"))["band"] for name in "ab"]
    assert both[0] == both[1]
    assert both[0]["people"] == 3
    spreads = [json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8"))["profile"][0] for name in "ab"]
    assert spreads[0]["median"] == pytest.approx(spreads[1]["median"], abs=0.01)
    refused(run("report", "her.npz", "--save-group", "c.json", "--out", "c.html"), "--group")
    assert not (tmp_path / "c.html").exists()


def test_a_guessed_map_makes_motion_of_a_file_with_other_names(run, lab, tmp_path):
    walk = motionenv.read(lab / "PiG" / "PiG_Motion3_FF.c3d")
    words = {"ASI": "Asis", "PSI": "Psis", "KNE": "KneeLateral", "ANK": "AnkleLateral", "HEE": "Heels", "TOE": "Toes"}
    kept = [i for i, n in enumerate(walk.names) if n[1:] in words and n[0] in "LR"]
    sides = {"L": "gauche", "R": "droite"}
    names = [f"{words[walk.names[i][1:]]} {sides[walk.names[i][0]]}" for i in kept]
    odd = motionenv.Markers(names, walk.positions[:, kept], walk.fps)
    motionenv.mocap.write_markers(odd, tmp_path / "odd.trc")
    assert run("mocap", "map", "odd.trc", "--out", "map.toml").code == 0
    assert len(MarkerMap.read(tmp_path / "map.toml").points) >= 10
    assert run("mocap", "convert", "odd.trc", "--map", "map.toml", "--out", "odd.npz").code == 0
    motion = motionenv.read(tmp_path / "odd.npz")
    assert np.isfinite(motion.poses[:, [20, 24]]).mean() > 0.9
    refused(run("report", "odd.trc", "--map", "plug-in-gate", "--out", "r.html"), "did you mean plug-in-gait?")


def test_a_c3d_gets_events_and_angles_and_keeps_its_points(run, lab, tmp_path):
    source = lab / "PiG" / "PiG_Motion3_FF.c3d"
    assert run("mocap", "convert", source, "--points", "--out", "mine.c3d").code == 0
    written = ezc3d.c3d(str(tmp_path / "mine.c3d"))["parameters"]
    assert {"LASI", "LKneeAngles"} <= set(written["POINT"]["LABELS"]["value"])
    assert written["EVENT"]["USED"]["value"][0] >= 12
    refused(run("mocap", "convert", source, "--points", "--out", "mine.glb"), ".c3d")
