import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import FormatError
from motionenv.mocap.readers import trc

SMALL = (
    "PathFileType\t4\t(X/Y/Z)\tsmall.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "100.00\t100.00\t2\t2\tmm\t100.00\t1\t2\n"
    "Frame#\tTime\tL.Knee\t\t\tR.Knee\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
    "\n"
    "1\t0.000\t100\t500\t20\t-100\t510\t30\n"
    "2\t0.010\t101\t501\t21\t-101\t511\t31\n"
)


def save(folder, text):
    path = folder / "a.trc"
    path.write_text(text, newline="")
    return path


def test_small_file_by_hand(tmp_path):
    path = save(tmp_path, SMALL)
    got = trc.read(path)
    assert got.names == ("L.Knee", "R.Knee")
    assert got.fps == 100
    np.testing.assert_allclose(got.positions[0], [[0.1, -0.02, 0.5], [-0.1, -0.03, 0.51]])
    np.testing.assert_allclose(trc.read(path, up="z").positions[0, 0], [0.1, 0.5, 0.02])
    np.testing.assert_allclose(trc.read(path, unit="m", up="z").positions[0, 0], [100, 500, 20])


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n\n", "\n"),
        lambda text: text.replace("\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n", ""),
        lambda text: text.replace("PathFileType\t4\t", "PathFileType  4\t"),
        lambda text: text.replace("Time\tL", "Times\t\tL"),
        lambda text: text.replace("100.00\t100.00\t2\t2\tmm", "  100.0\t\t 100.0\t\t  2\t\t  2\t\t mm"),
        lambda text: text.replace("\n", "\t\n"),
        lambda text: text.replace("\t2\t2\tmm", "\t2\t7\tmm"),
        lambda text: text.replace("31\n", "31\t7\t8\t9\n"),
        lambda text: text + "\n\n",
        lambda text: text.replace(".", ",").replace("L,Knee", "L.Knee").replace("R,Knee", "R.Knee"),
        lambda text: text.replace("\tmm", "\tMM."),
        lambda text: text.replace("\tmm", "\tMilimeters"),
        lambda text: text.replace("\t2\t2\tmm", "\t27107\t2\tmm"),
        lambda text: re.sub("\t+", "  ", text).replace("  \n", "\n"),
        lambda text: text.replace("small.trc", "C:\\M\xfcller.trc"),
        lambda text: re.sub(r"([XYZ])(\d)", lambda found: found[1] + str(int(found[2]) + 4), text),
    ],
    ids=[
        "windows",
        "mark",
        "no blank",
        "no X1",
        "spaces",
        "Times",
        "padded",
        "tabs",
        "count",
        "unlabelled",
        "blanks",
        "commas",
        "capitals",
        "misspelt",
        "cut out of a longer trial",
        "no tabs",
        "latin",
        "X5",
    ],
)
def test_ways_to_write_the_same(tmp_path, change):
    expected = trc.read(save(tmp_path, SMALL)).positions
    text = change(SMALL)
    assert text != SMALL
    path = tmp_path / "b.trc"
    path.write_bytes(text.encode("latin-1" if "\xfc" in text else "utf-8"))
    np.testing.assert_array_equal(trc.read(path).positions, expected)


def test_upright_points_say_which_axis_is_up(tmp_path):
    """A body of 1.7 m by 0.4 m by 0.5 m, whose length is along x, y or z in turn."""
    tall = np.array([[0.0, 0.0, 0.0], [1.7, 0.4, 0.5]])
    for shift, up in enumerate("xyz"):
        cells = np.roll(tall, shift, axis=1).ravel()
        rows = "".join(f"{i}\t{i / 100}\t" + "\t".join(map(str, cells + 1)) + "\n" for i in (0, 1))
        text = SMALL.split("1\t0.000")[0].replace("\tmm", "\tm") + rows
        got = trc.read(save(tmp_path, text)).positions
        assert np.ptp(got[0, :, 2]) == pytest.approx(1.7), up
        np.testing.assert_array_equal(got, trc.read(save(tmp_path, text), up=up).positions)


def test_options_for_silent_files_leave_what_a_file_states(tmp_path):
    path = save(tmp_path, SMALL)
    same, got = trc.read(path), trc.read(path, fps=50, unit="m", override=False)
    assert got.fps == 100
    np.testing.assert_array_equal(got.positions, same.positions)
    silent = save(tmp_path, SMALL.replace("\tmm", "\t238").replace("100.00", "0"))
    got = trc.read(silent, fps=100, unit="mm", override=False)
    np.testing.assert_array_equal(got.positions, same.positions)


@pytest.mark.parametrize("gap", ["\t\t", "nan\tnan\tNaN", "0\t0.0\t0.00", " \t1\t2"])
def test_every_kind_of_gap_is_nan(tmp_path, gap):
    got = trc.read(save(tmp_path, SMALL.replace("100\t500\t20", gap))).positions
    assert np.isnan(got[0, 0]).all()
    assert np.isfinite(got[1]).all()
    assert np.isfinite(got[0, 1]).all()


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.text("abcXYZ.,_ 019", min_size=1).filter(str.strip), min_size=1, max_size=5, unique_by=str.strip),
    st.integers(1, 4),
    st.sampled_from([("mm", 1e-3), ("m", 1.0), ("cm", 1e-2)]),
    st.randoms(use_true_random=False),
)
def test_what_is_written_is_read(tmp_path_factory, names, frames, unit, random):
    points = np.array(
        [[random.choice([None, random.uniform(-3e3, 3e3)]) for _ in names for _ in "xyz"] for _ in range(frames)]
    )
    lines = ["PathFileType\t4\t(X/Y/Z)\tx", "DataRate\tNumFrames\tNumMarkers\tUnits"]
    lines += [f"50\t{frames}\t{len(names)}\t{unit[0]}", "Frame#\tTime\t" + "\t\t\t".join(names)]
    for t, row in enumerate(points):
        cells = ["" if value is None else repr(float(value)) for value in row]
        lines.append("\t".join([str(t + 1), repr(t / 50), *cells]))
    path = save(tmp_path_factory.mktemp("trc"), "\n".join(lines) + "\n")
    got = trc.read(path, up="z")
    expected = points.astype(float).reshape(frames, len(names), 3) * unit[1]
    expected[np.isnan(expected).any(-1)] = np.nan
    assert got.names == tuple(name.strip() for name in names)
    assert got.fps == 50
    np.testing.assert_array_equal(got.positions, expected)


BAD = {
    "another kind": ("HIERARCHY\n", "line 1: must begin with PathFileType"),
    "cut in the header": ("\n".join(SMALL.split("\n")[:2]), "line 2: is truncated inside its header"),
    "no unit": (SMALL.replace("Units\t", "Unit\t"), "line 3: the unit of length is missing; .*pass "),
    "unknown unit": (SMALL.replace("\tmm", "\t238"), "line 3: the unit of length '238' is unknown; .*pass "),
    "no rate": (SMALL.replace("DataRate", "Rate"), "line 3: has no value for DataRate; pass fps="),
    "no labels": (SMALL.replace("Frame#", "Fram"), "line 4: expected the line of labels"),
    "no marker": (SMALL.replace("L.Knee", "").replace("R.Knee", ""), "line 4: names no marker"),
    "no data": (SMALL.split("1\t0.000")[0], "line 6: has no data after its header"),
    "cut off": (SMALL.split("2\t0.010")[0], "'NumFrames' says 2, but there are 1: it is truncated"),
    "frames lost": (
        SMALL.replace("\t2\t2\tmm", "\t9\t2\tmm") + "9\t0.080\t1\t2\t3\t4\t5\t6\n",
        "'NumFrames' says 9, but there are 3",
    ),
    "cut line": (SMALL[:-9], "line 8: expected 8 columns for 2 markers, got"),
    "not a number": (SMALL.replace("501", "5o1"), "line 8: column 4 must be a number, got '5o1'"),
    "infinite": (SMALL.replace("501", "-inf"), "line 8: column 4 must be finite"),
    "rate 0": (SMALL.replace("100.00", "0"), "line 3: 'DataRate' must be above 0, got '0'; pass fps="),
    "rate NaN": (SMALL.replace("100.00", "nan"), "line 3: DataRate must be finite"),
    "rate of another file": (SMALL.replace("100.00", "25"), "column 2: the times span 0.01 s, but .* pass fps="),
}


@pytest.mark.parametrize(("text", "problem"), BAD.values(), ids=BAD)
def test_bad_files_name_the_line(tmp_path, text, problem):
    path = save(tmp_path, text)
    with pytest.raises(FormatError, match=problem) as caught:
        trc.read(path)
    assert str(path) in str(caught.value)


def test_the_caller_knows_better(tmp_path):
    got = trc.read(save(tmp_path, SMALL.replace("100.00", "0").replace("\tmm", "\t238")), fps=25, unit="mm")
    assert got.fps == 25
    assert got.positions[0, 0, 2] == 0.5
