"""Tables of points: Qualisys's, Motive's and plain ones, written here in their layout."""

import csv

import numpy as np
import pytest

from motionenv import load, read_points, write
from motionenv.body.kinematics import markers
from motionenv.errors import FormatError
from motionenv.mocap import find_landmarks, read
from motionenv.types import MARKERS

FPS = 120.0
JOINTS = tuple(name for name in MARKERS if name not in ("head", "sternum", "pelvis"))
BONES = {
    "head": "Head", "sternum": "Chest", "pelvis": "Hip",
    **{f"{side}_{joint}": side[0].upper() + bone for side in ("left", "right") for joint, bone in (
        ("shoulder", "UArm"), ("elbow", "FArm"), ("wrist", "Hand"), ("hip", "Thigh"), ("knee", "Shin"),
        ("ankle", "Foot"),
    )},
}  # fmt: skip


@pytest.fixture(scope="module")
def walk():
    return load("walk/fpca").synthesize(seconds=1.0, fps=FPS, seed=3)


@pytest.fixture(scope="module")
def points(walk) -> np.ndarray:
    """The 15 markers (frames, 15, 3) [m] with a gap of the left knee."""
    found = markers(walk.poses, walk.skeleton).copy()
    found[10:14, MARKERS.index("left_knee")] = np.nan
    return found


def cells(points, scale, decimals=6) -> list[list[str]]:
    """The rows of a table, blank where there are gaps."""
    flat = (points * scale).reshape(len(points), -1)
    return [["" if np.isnan(x) else f"{x:.{decimals}f}" for x in row] for row in flat]


def save(folder, rows, name, delimiter="\t", encoding="utf-8"):
    path = folder / name
    with open(path, "w", encoding=encoding, newline="") as file:
        csv.writer(file, delimiter=delimiter).writerows(rows)
    return path


def qualisys(points, *, clock=True, columns=True, said=0):
    rows = [
        ["NO_OF_FRAMES", len(points) + said], ["NO_OF_CAMERAS", 8], ["NO_OF_MARKERS", len(MARKERS)], ["FREQUENCY", 120],
        ["NO_OF_ANALOG", 0], ["ANALOG_FREQUENCY", 0], ["DESCRIPTION", "--"],
        ["TIME_STAMP", "2011-02-17, 15:52:41.000", "6014.66"], ["DATA_INCLUDED", "3D"], ["MARKER_NAMES", *MARKERS],
        ["TRAJECTORY_TYPES", *["Measured"] * len(MARKERS)],
    ]  # fmt: skip
    if columns:
        rows.append(["Frame", "Time"] * clock + [f"{name} {axis}" for name in MARKERS for axis in "XYZ"])
    clocks = [[i + 1, f"{i / FPS:.5f}"] if clock else [] for i in range(len(points))]
    return rows + [front + row for front, row in zip(clocks, cells(points, 1000, 3), strict=True)]


@pytest.mark.parametrize("clock", [True, False])
@pytest.mark.parametrize("columns", [True, False])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-8-sig"])
def test_qualisys(tmp_path, points, clock, columns, encoding):
    got = read(save(tmp_path, qualisys(points, clock=clock, columns=columns), "a.tsv", encoding=encoding))
    assert (got.names, got.fps, got.notes) == (MARKERS, FPS, ())
    np.testing.assert_allclose(got.positions, points, atol=1e-6)


def test_a_frame_more_or_less_in_qualisys(tmp_path, points):
    got = read(save(tmp_path, qualisys(points, said=1), "a.tsv"))
    assert got.notes == (f"NO_OF_FRAMES says {len(points) + 1}, but there are {len(points)}: all are read",)
    with pytest.raises(FormatError, match=f"NO_OF_FRAMES says {len(points) + 50}, but there are {len(points)}"):
        read(save(tmp_path, qualisys(points, said=50), "a.tsv"))


def motive(points, *, version="1.23", unit=("Meters", 1.0), kinds=("Bone",), parent=False, space="Global"):
    """Bones with quaternions, and their markers, of a skeleton called Ann; y is up, and z is the world's x."""
    there = points[..., [1, 2, 0]] * unit[1]  # upright() takes (x, y, z) to (z, x, y)
    heads, data = [[], [], [], [], [], []], [[] for _ in points]
    for kind in kinds:
        for j, name in enumerate(MARKERS):
            rigid = kind == "Rigid Body"
            what = ["Rotation"] * 4 * (kind == "Bone") + ["Position"] * 3 + ["Mean Marker Error"] * rigid
            axes = list("XYZW" * (kind == "Bone") + "XYZ") + [""] * rigid
            label = f"Ann:{BONES[name] if kind == 'Bone' else name}"
            for row, word in zip(heads, (kind, label, "ID", "Root"), strict=False):
                row += [word] * len(what)
            heads[4] += what
            heads[5] += axes
            turn = ["0.0", "0.0", "0.0", "1.0"] * (kind == "Bone")
            # a body's fit to its markers is two centimetres off
            row_cells = cells(there[:, j : j + 1] + 0.02 * unit[1] * (kind == "Bone Marker"), 1)
            for row, three in zip(data, row_cells, strict=True):
                row += turn + three + ["0.1"] * (kind == "Rigid Body")
    about = ["Format Version", version, "Take Name", "Take 1", "Capture Frame Rate", "120.000000"]
    about += ["Export Frame Rate", "120.000000", "Rotation Type", "Quaternion", "Length Units", unit[0]]
    about += ["Coordinate Space", space]
    starts = [["", "Type"], ["", "Name"], ["", "ID"], ["", "Parent"], ["", ""], ["Frame", "Time (Seconds)"]]
    lines = [start + row for start, row in zip(starts, heads, strict=True)]
    if not parent:
        del lines[3]
    clock = [[i, f"{i / FPS:.6f}"] for i in range(len(points))]
    return [about, [], *lines, *(front + row for front, row in zip(clock, data, strict=True))]


@pytest.mark.parametrize("version", ["1.2", "1.21", "1.23", "1.25"])
@pytest.mark.parametrize("unit", [("Meters", 1.0), ("Centimeters", 100.0), ("Millimeters", 1000.0)])
def test_bones_of_motive(tmp_path, points, version, unit):
    rows = motive(points, version=version, unit=unit, parent=version == "1.25")
    got = read(save(tmp_path, rows, "a.csv", ","))
    assert (got.names, got.fps) == (tuple(f"Ann:{BONES[name]}" for name in MARKERS), FPS)
    np.testing.assert_allclose(got.positions, points, atol=2e-6)
    found = find_landmarks(got)
    assert found.marker_set == "motive"
    for name in JOINTS:
        np.testing.assert_allclose(found.positions[name], points[:, MARKERS.index(name)], atol=2e-6)


def test_measured_markers_go_before_fitted_ones(tmp_path, points):
    got = read(save(tmp_path, motive(points, kinds=("Bone Marker", "Marker")), "a.csv", ","))
    assert got.names == tuple(f"Ann:{name}" for name in MARKERS)
    np.testing.assert_allclose(got.positions, points, atol=2e-6)


def test_unlabelled_markers_and_errors_of_bodies_are_left_out(tmp_path, points):
    rows = [[word.replace("Ann:left_knee", "Unlabeled 7") if isinstance(word, str) else word for word in row]
            for row in motive(points, kinds=("Rigid Body",))]  # fmt: skip
    got = read(save(tmp_path, rows, "a.csv", ","))
    assert got.names == tuple(f"Ann:{name}" for name in MARKERS if name != "left_knee")


def test_two_skeletons_are_two_people(tmp_path, points):
    both = [a + [w.replace("Ann:", "Bob:") if isinstance(w, str) else w for w in b[2:]] if len(a) > 20 else a
            for a, b in zip(motive(points), motive(points + 1), strict=True)]  # fmt: skip
    path = save(tmp_path, both, "a.csv", ",")
    assert "2 people" in read(path).notes[0]
    np.testing.assert_allclose(read(path, person="Bob").positions, points + 1, atol=2e-6)


STYLES = {
    "snake": ("{name}_{axis}", "time"),
    "dots": ("{name}.{axis}", "Time (s)"),
    "capitals": ("{camel}{AXIS}", "Timestamp"),
    "blanks": ("{name} {AXIS}", "t"),
    "millimetres": ("{name}_{axis}_mm", "time_ms"),
    "brackets": ("{name} {axis} [mm]", "t [ms]"),
}


def plain(points, style, clock, scale=1.0):
    named, time = STYLES[style]
    axes = [
        named.format(name=name, camel=name.title().replace("_", ""), axis=axis, AXIS=axis.upper())
        for name in MARKERS
        for axis in "xyz"
    ]
    factor = 1000 if "ms" in time else 1
    front = [f"{i / FPS * factor:.5f}" if clock else str(i) for i in range(len(points))]
    return [
        [time if clock else "frame", *axes],
        *([a, *row] for a, row in zip(front, cells(points, scale), strict=True)),
    ]


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_plain_tables(tmp_path, points, style, delimiter):
    stated = "mm" in STYLES[style][0]
    path = save(tmp_path, plain(points, style, True, 1000 if stated else 1), "a.csv", delimiter)
    got = read(path)
    np.testing.assert_allclose(got.positions, points, atol=2e-6)
    assert got.fps == FPS
    assert find_landmarks(got).points.keys() >= set(MARKERS)
    assert ["in m the points span" in note for note in got.notes] == [True] * (not stated)


@pytest.mark.parametrize(("scale", "unit"), [(1, "m"), (100, "cm"), (1000, "mm")])
def test_the_unit_of_a_plain_table_is_a_persons(tmp_path, points, scale, unit):
    got = read(save(tmp_path, plain(points, "snake", True, scale), "a.csv", ","))
    np.testing.assert_allclose(got.positions, points, atol=2e-6)
    assert f"in {unit} the points span" in got.notes[0]
    assert read(save(tmp_path, plain(points, "snake", True, scale), "a.csv", ","), unit=unit).notes == ()


def test_decimal_commas(tmp_path, points):
    rows = [[str(word).replace(".", ",") for word in row] for row in plain(points, "snake", True)]
    np.testing.assert_allclose(read(save(tmp_path, rows, "a.csv", ";")).positions, points, atol=2e-6)


def test_frames_need_a_rate(tmp_path, points):
    path = save(tmp_path, plain(points, "snake", False), "a.csv", ",")
    with pytest.raises(FormatError, match=r"no column of times, such as time: pass fps= \(--fps\)"):
        read(path)
    assert read(path, fps=50).fps == 50


def test_our_own_table_of_a_motion_is_read(tmp_path, walk):
    write(walk, tmp_path / "a.csv")
    got = read(tmp_path / "a.csv")
    at = [got.index(name) for name in MARKERS]
    np.testing.assert_allclose(got.positions[:, at], markers(walk.poses, walk.skeleton), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1,2,3\n4,5,6\n", "line 1: has no header line"),
        ("time,hip_x,hip_y\n0,1,2\n", "line 1: has 2D points: lift them .*read_points"),
        ("Individual,Height\nA,1.7\n", "line 1: is no table of points"),
        ("time,hip_x,hip_y,hip_z\n", "no data after its header"),
        ("time,hip_x,hip_y,hip_z\n0,1,2\n", "line 2: expected 4 columns, got 3"),
        ("time,hip_x,hip_y,hip_z\n0,1,2,oh\n", "line 2: hip_z must be a number, got 'oh'"),
        ("time,a_x_m,a_y_m,a_z_m\n0,1,2,3\n5,1,2,3\n", "time must grow in even steps of at most a second"),
        ("time,a_x,a_y,a_z\n0,1,2,3\n0.1,1,2,3\n", "doesn't state its unit of length; pass unit="),
        ("NO_OF_FRAMES\t2\nDATA_INCLUDED\t6D\n1\t2\n", "no MARKER_NAMES: export 3D data .*, not 6D"),
        ("NO_OF_FRAMES\t2\nMARKER_NAMES\tA\n", "no data after its header"),
        ("NO_OF_FRAMES\t1\nMARKER_NAMES\tA\nFREQUENCY\tx\n1\t2\t3\n", "FREQUENCY must be above 0, got 'x'"),
        ("Format Version,1.23\n\n,Type,Bone\n", "no line that begins with Frame"),
    ],
)
def test_what_is_no_table_says_why(tmp_path, text, says):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(FormatError, match=says):
        read(path)


def test_bones_in_each_others_axes_and_rotations_alone_are_refused(tmp_path, points):
    with pytest.raises(FormatError, match="coordinate space Global"):
        read(save(tmp_path, motive(points, space="Local"), "a.csv", ","))
    turned = [[w if w != "Position" else "Rotation" for w in row] for row in motive(points)]
    with pytest.raises(FormatError, match="has no positions"):
        read(save(tmp_path, turned, "a.csv", ","))


def test_lift_says_that_a_table_has_three_dimensions(tmp_path, points):
    with pytest.raises(
        FormatError, match="has 3D points: project them with --project, or read them with motionenv.read"
    ):
        read_points(save(tmp_path, plain(points, "millimetres", False), "a.csv", ","))


@pytest.mark.parametrize("column", ["frame", "time"])
def test_lines_of_missing_frames_are_asked_for(tmp_path, column):
    """With a frame rate, too: the lines would be taken for frames that follow each other."""
    path = tmp_path / "a.csv"
    path.write_text(f"{column},a_x_m,a_y_m,a_z_m\n" + "".join(f"{t},1,2,{3 + t}\n" for t in (0, 1, 2, 5, 6)))
    with pytest.raises(FormatError, match=f"{column} must grow in even steps"):
        read(path, fps=50)
    path.write_text(f"{column},a_x_m,a_y_m,a_z_m\n" + "".join(f"{t},1,2,{3 + t}\n" for t in (10, 12, 14)))
    assert read(path, fps=50, unit="m").positions.shape == (3, 1, 3)


@pytest.mark.parametrize("rate", [120, 240])
def test_times_rounded_to_a_digit_that_is_longer_than_frames_need_the_frame_rate(tmp_path, rate):
    path = tmp_path / "a.csv"
    lines = [f"{round(i / rate, 2)},{i},2,3\n" for i in range(60)]
    path.write_text("time,a_x_m,a_y_m,a_z_m\n" + "".join(lines))
    assert read(path, fps=rate).positions.shape == (60, 1, 3)
    with pytest.raises(FormatError, match="must grow in even steps"):
        read(path)
    path.write_text("time,a_x_m,a_y_m,a_z_m\n" + "".join(lines[:20] + lines[30:]))
    with pytest.raises(FormatError, match="must grow in even steps"):
        read(path, fps=rate)
