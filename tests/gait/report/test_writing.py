"""Reports on disk."""

import json

import pytest

from motionenv.errors import MotionError
from motionenv.gait import shipped_band, write_report

WALK = "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d"


def test_three_files_with_the_same_figures(mocap, tmp_path):
    seen = []
    session = write_report([mocap / WALK], tmp_path / "a.html", on_step=seen.append)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "a.html", "a.json"]
    assert seen == ["PiG_Motion3_FF.c3d"]
    assert session.band is shipped_band()
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["captures"][0]["strides"] == 4
    write_report([mocap / WALK], tmp_path / "b.html")
    for kind in ("html", "json", "csv"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_nothing_is_written_where_nothing_can_be_analysed(mocap, tmp_path):
    with pytest.raises(MotionError, match="no file can be analysed"):
        write_report([mocap / "btkdata/TRCSamples/Empty.trc"], tmp_path / "a.html")
    with pytest.raises(MotionError, match=r"must end in .html, got a.pdf"):
        write_report([mocap / WALK], tmp_path / "a.pdf")
    assert list(tmp_path.iterdir()) == []


def test_what_stood_there_stays_if_writing_fails(mocap, tmp_path):
    (tmp_path / "a.html").mkdir()
    with pytest.raises(MotionError):
        write_report([mocap / WALK], tmp_path / "a.html")
    assert [p.name for p in tmp_path.iterdir()] == ["a.html"]
