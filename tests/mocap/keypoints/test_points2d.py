"""2D points in files: tables that come back to the last digit, keypoints by their definition, TRC, damaged files."""

import json
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.points2d import read_people, read_points, write_points
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.types import MARKERS, Points
from tests.mocap.keypoints.people_json import expected, person, results, saved, walker

KEYPOINTS = KEYPOINT_SETS["coco-17"].keypoints
RATES = st.one_of(
    st.sampled_from([24.0, 25.0, 29.97, 30.0, 59.94, 60.0, 100.0, 119.88, 120.0, 30000 / 1001, 24000 / 1001]),
    st.floats(5, 500).map(lambda f: float(f"{f:.6g}")),
)


def at(name) -> int:
    return MARKERS.index(name)


def some_points(seed=0, frames=12, fps=30.0, unit="px", gaps=0.2) -> Points:
    rng = np.random.default_rng(seed)
    positions = rng.normal(0, 10.0 ** rng.integers(-3, 4), (frames, 15, 2))
    positions[rng.random((frames, 15)) < gaps] = np.nan
    return Points(positions, fps, unit)


@settings(max_examples=40)
@given(st.integers(0, 1000), st.integers(2, 40), RATES, st.sampled_from(["m", "px"]), st.floats(0, 1))
def test_tables_come_back_to_the_last_digit(tmp_path_factory, seed, frames, fps, unit, gaps):
    path = tmp_path_factory.mktemp("table") / "walk.csv"
    points = some_points(seed, frames, fps, unit, gaps)
    write_points(points, path)
    back = read_points(path)
    np.testing.assert_array_equal(back.positions, points.positions)
    assert (back.unit, back.name) == (unit, "walk")
    # More than one rate can give the same times, of a few frames
    assert back.fps == pytest.approx(fps, rel=1e-12)
    np.testing.assert_array_equal(np.arange(frames) / back.fps, np.arange(frames) / fps)


def test_markers_without_columns_and_rows_left_out_are_gaps(tmp_path):
    text = "frame,head_y_m,head_x_m,left_knee_x_m,left_knee_y_m\n7,2,1,3,4\n8,,5,6,7\n\n10,9,8,,\n"
    points = read_points(saved(tmp_path, text, "a.csv"), fps=50)
    assert (points.fps, points.unit, len(points.positions)) == (50, "m", 4)
    expected = np.full((4, 15, 2), np.nan)
    expected[[0, 3], at("head")] = [[1, 2], [8, 9]]
    expected[[0, 1], at("left_knee")] = [[3, 4], [6, 7]]
    np.testing.assert_array_equal(points.positions, expected)


def test_times_rounded_to_milliseconds_give_the_rate(tmp_path):
    rows = [f"{i / 30:.3f},1,2" for i in range(300) if i % 7]
    points = read_points(saved(tmp_path, "\n".join(["time_s,head_x_px,head_y_px", *rows]), "a.csv"))
    assert points.fps == pytest.approx(30, rel=1e-4)
    assert len(points.positions) == 299
    assert np.isnan(points.positions[6::7]).all()


def test_a_unit_that_is_said_stands_before_the_columns(tmp_path):
    path = saved(tmp_path, "time_s,head_x_m,head_y_m\n0,1000,1700\n0.1,1010,1690\n", "a.csv")
    np.testing.assert_allclose(read_points(path, unit="mm").positions[:, 0], [[1.0, 1.7], [1.01, 1.69]])
    assert read_points(path, unit="px").unit == "px"
    with pytest.raises(MotionError, match="unit must be"):
        read_points(path, unit="furlong")


def test_coco_keypoints_become_markers(tmp_path):
    points = read_points(saved(tmp_path, results()), fps=25)
    assert (points.unit, points.fps, points.positions.shape) == ("px", 25, (10, 15, 2))
    k = np.array(person(200)).reshape(17, 3)[:, :2]
    where = {name: k[KEYPOINTS.index(name)] for name in KEYPOINTS}
    hips, shoulders = (0.5 * (where[f"left_{n}"] + where[f"right_{n}"]) for n in ("hip", "shoulder"))
    first = dict(zip(MARKERS, points.positions[0], strict=True))
    for name in MARKERS[3:]:
        np.testing.assert_array_equal(first[name], where[name])
    np.testing.assert_allclose(first["head"], 0.5 * (where["left_ear"] + where["right_ear"]))
    np.testing.assert_allclose(first["pelvis"], hips)
    np.testing.assert_allclose(first["sternum"], 0.885 * shoulders + 0.115 * hips)


def test_the_sternum_of_coco_is_where_cmu_walkers_have_theirs(mocap):
    from motionenv.mocap import read, to_markers

    p = to_markers(read(mocap / "cmu_asfamc" / "07" / "07_01.amc", fps=120)).positions
    shoulders, hips = (0.5 * (p[:, at(f"left_{n}")] + p[:, at(f"right_{n}")]) for n in ("shoulder", "hip"))
    off = np.linalg.norm(shoulders + 0.115 * (hips - shoulders) - p[:, at("sternum")], axis=-1)
    assert np.median(off) < 0.03


@pytest.mark.parametrize(
    ("hidden", "lost"),
    [
        (("left_knee",), {"left_knee"}),
        (("left_ear",), set()),
        (("left_ear", "right_ear"), {"head"}),
        (("right_hip",), {"right_hip", "pelvis", "sternum"}),
        (("nose", "left_eye"), set()),
    ],
)
@pytest.mark.parametrize("how", ["score", "zeros"])
def test_what_is_unsure_is_a_gap(tmp_path, hidden, lost, how):
    content = results()
    for name in hidden:
        i = 3 * KEYPOINTS.index(name)
        content[4]["keypoints"][i : i + 3] = [7.0, 8.0, 0.29] if how == "score" else [0, 0, 0]
    points = read_points(saved(tmp_path, content), fps=25)
    gone = np.isnan(points.positions).all(-1)
    assert {MARKERS[m] for m in np.flatnonzero(gone[4])} == lost
    assert gone.sum() == len(lost)
    assert not np.isnan(read_points(saved(tmp_path, results(1)), fps=25, confidence=0.9).positions).any()


def test_in_a_data_set_points_of_visibility_0_are_gaps_and_those_of_1_are_not(tmp_path):
    annotations = results(3)
    for visibility, entry in enumerate(annotations):
        entry["keypoints"][2::3] = [visibility] * 17
    points = read_points(saved(tmp_path, {"images": [{"id": i} for i in range(3)], "annotations": annotations}), fps=25)
    assert np.isnan(points.positions).all((1, 2)).tolist() == [True, False, False]
    assert not np.isnan(points.positions[1:]).any()


HEAD = "time_s,head_x_m,head_y_m\n"
WRONG = {
    "empty": ("", "empty"),
    "no column": ("a,b\n1,2\n", "first column"),
    "typo": ("time_s,haed_x_m,haed_y_m\n0,1,2\n1,1,2\n", "haed_x_m"),
    "3D": ("time_s,head_x_m,head_y_m,head_z_m\n0,1,2,3\n", "has 3D points: project them with --project"),
    "half": ("time_s,head_x_m\n0,1\n1,2\n", "x and y of each"),
    "units": ("time_s,head_x_m,head_y_px\n0,1,2\n1,2,3\n", "all in m or all in px"),
    "nothing": ("time_s\n0\n1\n", "all in m or all in px"),
    "twice": ("time_s,head_x_m,head_x_m\n0,1,2\n", "markers once"),
    "one row": (HEAD + "0,1,2\n", "2 to"),
    "word": (HEAD + "0,1,2\n1,x,2\n", "line 3: head_x_m must be a number, got 'x'"),
    "infinite": (HEAD + "0,1,2\n1,inf,2\n", "finite"),
    "nan": (HEAD + "0,1,2\n1,nan,2\n", "finite"),
    "ragged": (HEAD + "0,1,2\n1,1\n", "line 3: expected 3 columns"),
    "no time": (HEAD + "0,1,2\n,1,2\n", "line 3: time_s must be there"),
    "backwards": (HEAD + "0,1,2\n1,1,2\n0.5,1,2\n", "must grow"),
    "irregular": (HEAD + "0,1,2\n1,1,2\n2,1,2\n3.5,1,2\n", "regular"),
    "bomb": (HEAD + "0,1,2\n1,1,2\n2,1,2\n1e6,1,2\n", "more than 100000"),
    "frames": ("frame,head_x_m,head_y_m\n0,1,2\n1,1,2\n", "pass fps="),
    "quote": (HEAD + '0,"1,2\n', "CSV"),
    "binary": ("time_s\0", "binary"),
    "long": (HEAD + "".join(f"{i},1,2\n" for i in range(100_001)), "100000"),
}


@pytest.mark.parametrize("damage", WRONG)
def test_damaged_tables_say_what_is_wrong(tmp_path, damage):
    text, says = WRONG[damage]
    with pytest.raises(FormatError, match=says) as error:
        read_points(saved(tmp_path, text, "a.csv"))
    assert "a.csv" in str(error.value)


@settings(max_examples=150)
@given(st.data())
def test_no_damage_gives_anything_but_a_format_error(tmp_path_factory, data):
    whole = data.draw(st.sampled_from([json.dumps(results(3)), HEAD + "0,1,2\n1,3,4\n2,5,6\n"]))
    for _ in range(data.draw(st.integers(1, 4))):
        i, j = sorted(data.draw(st.tuples(st.integers(0, len(whole)), st.integers(0, len(whole)))))
        word = data.draw(st.sampled_from(["", "0", "null", "[", "{", '"', "1e400", "-", "\n", ",", "true", "\0", "é"]))
        whole = whole[:i] + word + (whole[j:] if data.draw(st.booleans()) else whole[i:])
    path = tmp_path_factory.mktemp("damaged") / data.draw(st.sampled_from(["a.json", "a.csv"]))
    path.write_text(whole, encoding="utf-8")
    with suppress(FormatError):
        read_points(path, fps=30)


def test_settings_are_checked(tmp_path):
    path = saved(tmp_path, results())
    with pytest.raises(FormatError, match="frame rate"):
        read_points(path)
    with pytest.raises(MotionError, match="fps"):
        read_points(path, fps=0)
    with pytest.raises(MotionError, match="confidence"):
        read_points(path, fps=30, confidence=2)
    with pytest.raises(FormatError, match="can't be read"):
        read_points(tmp_path / "none.json", fps=30)
    with pytest.raises(FormatError, match="must be keypoints"):
        read_points(saved(tmp_path, "x", "a.txt"), fps=30)
    with pytest.raises(MotionError, match="two frames"):
        write_points(some_points(frames=1), tmp_path / "b.csv")
    with pytest.raises(FormatError, match="regular"):
        read_points(saved(tmp_path, "frame,head_x_m,head_y_m\n0,1,2\n1,1,2\n2.5,1,2\n", "a.csv"), fps=30)


def test_scores_become_confidence(tmp_path):
    content = results(4)
    content[2]["keypoints"][2::3] = [1.3] * 17
    content[2]["keypoints"][3 * KEYPOINTS.index("left_knee") + 2] = 0.5
    points = read_points(saved(tmp_path, content), fps=25)
    np.testing.assert_allclose(np.delete(points.confidence, 2, axis=0), 0.9)
    assert points.confidence[2, at("left_knee")] == 0.5
    assert points.confidence[2, at("right_knee")] == 1.0
    hidden = read_points(saved(tmp_path, content), fps=25, confidence=0.6)
    assert hidden.confidence[2, at("left_knee")] == 0
    write_points(points, tmp_path / "b.csv")
    assert read_points(tmp_path / "b.csv").confidence is None


def test_everybody_is_read_in_pixels_whatever_the_file_has(tmp_path):
    frames = [results(4), [{**r, "keypoints": person(900)} for r in results(6)]]
    path = saved(tmp_path, [one for some in frames for one in some])
    people = read_people(path, 25.0, (1280, 720))
    assert len(people) == 2
    for number, one in enumerate(people):
        alone = read_points(path, fps=25, person=number)
        np.testing.assert_array_equal(one.positions, alone.positions)
        np.testing.assert_array_equal(one.confidence, alone.confidence)
    landmarks = [{"x": x / 640, "y": y / 480, "visibility": v} for x, y, v in walker("mediapipe-33")[0].tolist()]
    (one,) = read_people(saved(tmp_path, [{"frame": 0, "landmarks": landmarks}]), 25.0, (640, 480))
    np.testing.assert_allclose(one.positions, expected("mediapipe-33")[:1])
    write_points(some_points(), tmp_path / "table.csv")
    (one,) = read_people(tmp_path / "table.csv", 30.0, (640, 480))
    np.testing.assert_array_equal(one.positions, some_points().positions)


def test_coordinates_relative_to_the_picture_need_its_size(tmp_path):
    whole = walker("mediapipe-33")
    small = whole / [640, 480, 1]
    frames = [
        {"frame": i, "landmarks": [{"x": x, "y": y, "z": 0.0, "visibility": v} for x, y, v in k]}
        for i, k in enumerate(small.tolist())
    ]
    path = saved(tmp_path, frames)
    points = read_points(path, fps=25, size=(640, 480))
    np.testing.assert_allclose(points.positions, expected("mediapipe-33"))
    with pytest.raises(FormatError, match=r"pass size=\(width, height\) \(--size"):
        read_points(path, fps=25)
    with pytest.raises(MotionError, match="size must be width and height"):
        read_points(path, fps=25, size=640)
    with pytest.raises(FormatError, match="omit size"):
        read_points(saved(tmp_path, results()), fps=25, size=(640, 480))


def test_the_format_can_be_said(tmp_path):
    content = [{"image_id": i, "keypoints": k.ravel().tolist()} for i, k in enumerate(walker("human36m-17"))]
    path = saved(tmp_path, content)
    right = read_points(path, fps=25)
    np.testing.assert_allclose(right.positions, expected("human36m-17"))
    np.testing.assert_array_equal(read_points(path, fps=25, format="human36m-17").positions, right.positions)
    assert not np.allclose(read_points(path, fps=25, format="coco-17").positions, right.positions, equal_nan=True)
    with pytest.raises(FormatError, match="expected 26"):
        read_points(path, fps=25, format="halpe-26")


def sports2d(keypoints, path, z=0.0, fps=60) -> str:
    """A TRC as `make_trc_with_trc_data` of Sports2D writes it: pixels, y downwards, with "m" as their unit."""
    names = {"mid_hip": "Hip", "head_top": "Head", "neck": "Neck", "nose": "Nose"}
    sides = {"left": "L", "right": "R"}
    known = KEYPOINT_SETS["halpe-26"].keypoints
    keep = [i for i, name in enumerate(known) if not name.endswith(("eye", "ear"))]
    labels = [names.get(n) or sides[n.split("_")[0]] + "".join(w.title() for w in n.split("_")[1:]) for n in known]
    head = ["PathFileType\t4\t(X/Y/Z)\t" + path.name,
            "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
            f"{fps}\t{fps}\t{len(keypoints)}\t{len(keep)}\tm\t{fps}\t0\t{len(keypoints)}",
            "Frame#\tTime\t" + "\t\t\t".join(labels[i] for i in keep) + "\t\t",
            "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, len(keep) + 1))]  # fmt: skip
    rows = [
        f"{t}\t{t / fps}\t"
        + "\t".join(
            "\t\t" if np.isnan(x) else f"{x}\t{y}\t{np.broadcast_to(z, len(keypoints))[t]}" for x, y, _ in k[keep]
        )
        for t, k in enumerate(keypoints)
    ]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return str(path)


def test_trc_files_in_pixels_of_sports2d(tmp_path):
    keypoints = walker("halpe-26")
    keypoints[3:6, 9] = np.nan
    points = read_points(sports2d(keypoints, tmp_path / "walk_px_person00.trc"))
    truth = expected("halpe-26")
    truth[3:6, at("left_wrist")] = np.nan
    np.testing.assert_allclose(points.positions, truth, atol=1e-9)
    assert (points.unit, points.fps, points.name, points.confidence) == ("px", 60, "walk_px_person00", None)
    metres = keypoints * [0.004, -0.004, 1] + [0, 2, 0]
    points = read_points(sports2d(metres, tmp_path / "walk_m_person00.trc"))
    np.testing.assert_allclose(points.positions, truth * [0.004, -0.004] + [0, 2], atol=1e-9)
    assert points.unit == "m"
    deep = read_points(sports2d(metres, tmp_path / "Walk 2_m_person00.TRC", z=0.129, fps=30))
    np.testing.assert_array_equal(deep.positions, points.positions)
    for frames, z in ((20, np.linspace(0.5, 0.6, 20)), (1, 0.5)):
        with pytest.raises(FormatError, match="has 3D points"):
            read_points(sports2d(keypoints[:frames], tmp_path / "b.trc", z=z))
    with pytest.raises(MotionError, match="omit them"):
        read_points(tmp_path / "walk_px_person00.trc", person=1)


def test_real_3d_files_of_pose2sim_are_not_taken_for_pictures(mocap):
    with pytest.raises(FormatError, match="has 3D points"):
        read_points(mocap / "pose2sim" / "from_history" / "S00_P00_T01_BalancingTrial_0-100.trc")


def test_trc_files_of_other_points_are_refused(tmp_path):
    path = sports2d(walker("halpe-26"), tmp_path / "c.trc")
    text = (tmp_path / "c.trc").read_text()
    for name in KEYPOINT_SETS["halpe-26"].keypoints:
        text = text.replace("".join(word.title() for word in name.split("_")[1:]) or name.title(), "P")
    (tmp_path / "c.trc").write_text(text)
    with pytest.raises(FormatError, match="no keypoints with known names"):
        read_points(path)
