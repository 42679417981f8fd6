"""What YOLO, DeepLabCut, SLEAP, VideoPose3D and FreeMoCap export, written here as they write it; and damaged."""

import io
import pickle
import zipfile
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.exports import keypoint_name
from motionenv.mocap.keypoints.points2d import read_people, read_points, write_points
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.types import Points
from tests.mocap.keypoints.people_json import expected, saved, walker

SIZE = (1280, 720)
COCO = KEYPOINT_SETS["coco-17"].keypoints


def read(path, **how) -> np.ndarray:
    return read_points(path, **{"fps": 25} | how).positions


def yolo(folder, people, names="clip one_{}.txt", more=(), columns=3, ends="\n"):
    """A folder of Ultralytics' save_txt: for each frame, a line per person."""
    folder.mkdir()
    for t, frame in enumerate(zip(*people, strict=True)):
        lines = []
        for who, keypoints in enumerate(frame):
            relative = (keypoints / [*SIZE, 1])[:, :columns]
            values = [0, 0.5, 0.5, 0.2, 0.6, *relative.ravel(), *[value(who) for value in more]]
            lines.append(" ".join(f"{value:.9g}" for value in values))
        (folder / names.format(t + 8)).write_text(ends.join(lines) + ends, newline="")
    return folder


@pytest.mark.parametrize(("kind", "columns"), [("coco-17", 3), ("coco-17", 2), ("halpe-26", 3), ("body-25", 3)])
@pytest.mark.parametrize("more", [(), (lambda who: 0.875,), (lambda who: who + 3,), (lambda who: 0.875, lambda who: 3)])
def test_yolo_text(tmp_path, kind, columns, more):
    folder = yolo(tmp_path / "labels", [walker(kind)], "take2_{:05d}.TXT", more, columns, "\r\n")
    (folder / "classes.txt").write_text("person\n")
    np.testing.assert_allclose(read(folder, size=SIZE), expected(kind), atol=1e-5)
    with pytest.raises(FormatError, match="relative to the picture: pass size="):
        read(folder)
    with pytest.raises(FormatError, match="no frame rate"):
        read_points(folder, size=SIZE)


def test_yolo_text_of_several_people_with_gaps(tmp_path):
    one, two = walker(), walker(shift=600, score=0.7)
    folder = yolo(tmp_path / "labels", [two, one])
    (folder / "clip one_12.txt").unlink()
    (folder / "clip one_13.txt").write_text("16 0.5 0.5 0.1 0.1" + " 0.5" * 51 + "\n\n")  # a dog
    for person, shift in ((0, 0.0), (1, 600.0)):
        found = read(folder, person=person, size=SIZE)
        assert np.isnan(found).all((1, 2)).nonzero()[0].tolist() == [4, 5]
        np.testing.assert_allclose(np.delete(found, (4, 5), 0), np.delete(expected(shift=shift), (4, 5), 0), atol=1e-5)
    assert len(read_people(folder, 25.0, SIZE)) == 2
    ids = yolo(tmp_path / "ids", [two, one], more=(lambda who: 0.875, lambda who: 7 - who))
    np.testing.assert_allclose(read(ids, person=0, size=SIZE), expected(), atol=1e-5)


@pytest.mark.parametrize(
    ("line", "says"),
    [("0 0.5 0.5 0.1 0.1", "got 5 columns"), ("0 0.5 x", "must be a number"), ("0 0.5 nan", "finite")],
)
def test_yolo_text_that_is_damaged(tmp_path, line, says):
    folder = yolo(tmp_path / "labels", [walker()])
    (folder / "clip one_9.txt").write_text(line)
    with pytest.raises(FormatError, match=says):
        read(folder, size=SIZE)
    with pytest.raises(FormatError, match="pass the folder of all frames"):
        read(folder / "clip one_8.txt", size=SIZE)


def deeplabcut(path, people, names, individuals=None, likelihood=True, rows=None, ends="\n"):
    """DeepLabCut's CSV of keypoints (frames, n, 3) of one or several individuals."""
    coords = ["x", "y", "likelihood"] if likelihood else ["x", "y"]
    count = len(people) * len(names) * len(coords)
    head = [["scorer", *["DLC_resnet50_walkFeb9shuffle1_30000"] * count]]
    if individuals:
        head.append(["individuals", *np.repeat(individuals, len(names) * len(coords))])
    head += [
        ["bodyparts", *np.tile(np.repeat(names, len(coords)), len(people))],
        ["coords", *coords * (count // len(coords))],
    ]
    body = []
    for t in range(len(people[0])):
        values = np.concatenate([k[t][:, : len(coords)].ravel() for k in people])
        body.append([str(t) if rows is None else rows[t], *["" if np.isnan(v) else repr(float(v)) for v in values]])
    path.write_text("".join(",".join(row) + ends for row in head + body), newline="")
    return path


STYLES = {
    "DeepLabCut's SuperAnimal": lambda name: name,
    "Pose2Sim's": lambda name: "".join(w[0] if w in ("left", "right") else w for w in name.split("_")).title()
                               if "_" in name else name,
    "sides last": lambda name: "_".join([*name.split("_")[1:], name.split("_")[0]]) if "_" in name else name,
    "camels": lambda name: "".join([name.split("_")[0], *[w.title() for w in name.split("_")[1:]]]),
    "with blanks": lambda name: name.replace("_", " ").title(),
    "letters last": lambda name: "".join(w.title() for w in name.split("_")[1:]) + f"_{name[0].upper()}"
                                 if "_" in name else name,
}  # fmt: skip


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_deeplabcut(tmp_path, style, ends):
    order = np.random.default_rng(1).permutation(len(COCO))
    keypoints = walker(frames=30)[:, order]
    keypoints[4, 3:9] = np.nan
    keypoints[7, :, 2] = 0.1
    names = [STYLES[style](COCO[i]) for i in order]
    path = deeplabcut(tmp_path / "My video.CSV", [keypoints], names, ends=ends)
    found, truth = read_points(path, fps=50), expected(frames=30)
    assert found.fps == 50
    assert np.isnan(found.positions[7]).all()
    shown = np.isfinite(found.positions)
    assert 0.9 < shown.mean() < 29 / 30
    np.testing.assert_allclose(found.positions[shown], truth[shown])
    np.testing.assert_allclose(found.confidence[shown.all(-1)], 0.9)
    with pytest.raises(FormatError, match="no frame rate"):
        read_points(path)
    lines = path.read_text().splitlines()  # as spreadsheets save it
    quoted = "\ufeff" + "".join(",".join(f'"{word}"' for word in line.split(",")) + "\n" for line in lines)
    np.testing.assert_array_equal(read(saved(tmp_path, quoted, "b.csv"), fps=50), found.positions)


def test_deeplabcut_of_several_individuals(tmp_path):
    one, two = walker(frames=30), walker(frames=30, shift=500, score=0.8)
    one[:4] = np.nan
    path = deeplabcut(tmp_path / "a.csv", [two, one], list(COCO), ["ann", "bob"])
    with pytest.raises(FormatError, match=r"shows 2 people.*\(--person\)"):
        read(path)
    np.testing.assert_allclose(read(path, person=1)[4:], expected(frames=30)[4:])
    np.testing.assert_allclose(read(path, person=0), expected(frames=30, shift=500))


def test_deeplabcut_that_people_labelled(tmp_path):
    pictures = [f"labeled-data/walk 3/img{5 * i:04d}.png" for i in range(20)]
    path = deeplabcut(tmp_path / "a.csv", [walker()], list(COCO), likelihood=False, rows=pictures)
    np.testing.assert_allclose(read(path)[::5], expected())
    text = path.read_text().replace("labeled-data/walk 3/", "labeled-data,walk 3,")
    text = text.replace("scorer,", "scorer,,,").replace("bodyparts,", "bodyparts,,,").replace("coords,", "coords,,,")
    path.write_text(text)
    np.testing.assert_allclose(read(path)[::5], expected())


def sleap(path, people, tracks, order=None):
    """SLEAP's analysis CSV: a row per track and frame."""
    head = ["track", "frame_idx", "instance.score", *[f"{n}.{c}" for n in COCO for c in ("x", "y", "score")]]
    rows = [
        [track, str(t + 100), "0.87", *["" if np.isnan(v) else repr(float(v)) for v in k.ravel()]]
        for track, keypoints in zip(tracks, people, strict=True) for t, k in enumerate(keypoints)
    ]  # fmt: skip
    rows = rows if order is None else [rows[i] for i in order]
    path.write_text("\n".join(map(",".join, [head, *rows])) + "\n")
    return path


def test_sleap(tmp_path):
    one, two = walker(), walker(shift=500, score=0.8)
    one[5, 15] = np.nan
    truth = expected()
    truth[5, 13] = np.nan
    path = sleap(tmp_path / "walk.000_walk.analysis.csv", [one], [""])
    np.testing.assert_allclose(read(path), truth)
    mixed = np.random.default_rng(0).permutation(40)
    path = sleap(tmp_path / "b.csv", [two, one], ["track_0", "track_1"], mixed)
    np.testing.assert_allclose(read(path, person=0), truth)
    np.testing.assert_allclose(read(path, person=1), expected(shift=500))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("scorer,a,a\nbodyparts,left_knee,left_knee\n0,1,2\n", "rows scorer, bodyparts and coords"),
        ("scorer,a,a\nbodyparts,snout,snout\ncoords,x,y\n0,1,2\n", "no keypoints with known names.*snout"),
        ("scorer,a\nbodyparts,left_knee\ncoords,x\n0,1\n", "no person"),
        ("scorer,a,a\nbodyparts,left_knee,left_knee\ncoords,x,y\n0,1\n", "line 4: expected 3 columns"),
        ("scorer,a,a\nbodyparts,left_knee,left_knee\ncoords,x,y\n0,1,b\n", "line 4: column 3 must be a number"),
        ("scorer,a,a\nbodyparts,left_knee,left_knee\ncoords,x,y\n", "no person"),
        ("track,frame_idx,instance.score,left_knee.x\n,1,1,1\n", "no person"),
        ("track,frame_idx,instance.score,left_knee.x,left_knee.y\n,b,1,1,2\n", "frame_idx must be a number"),
    ],
)
def test_tables_that_are_damaged(tmp_path, text, says):
    with pytest.raises(FormatError, match=says):
        read(saved(tmp_path, text, "a.csv"))


def videopose3d(path, content, kind="coco"):
    """As prepare_data_2d_custom.py of VideoPose3D saves it."""
    metadata = {"layout_name": kind, "num_joints": 17, "keypoints_symmetry": [[1, 3], [2, 4]]}
    np.savez_compressed(path, positions_2d=content, metadata=metadata)
    return path


def test_videopose3d(tmp_path):
    one, two = walker()[..., :2].astype(np.float32), walker(frames=12, shift=300)[..., :2]
    path = videopose3d(tmp_path / "data_2d_custom_my walk.npz", {"my walk.mp4": {"custom": [one]}})
    np.testing.assert_allclose(read(path), expected(), atol=1e-4)
    both = videopose3d(tmp_path / "b.NPZ".lower(), {"S1": {"Walking 1": [two, one]}, "S2": {"Eating": []}})
    with pytest.raises(FormatError, match="shows 2 people"):
        read(both)
    np.testing.assert_allclose(read(both, person=0), expected(), atol=1e-4)
    np.testing.assert_allclose(read(both, person=1)[:12], expected(frames=12, shift=300))
    human = videopose3d(tmp_path / "c.npz", {"S1": {"Walking": [walker("human36m-17")[..., :2]]}}, "h36m")
    np.testing.assert_allclose(read(human), expected("human36m-17"))


class Harmful:
    """What runs code when it is unpickled."""

    def __reduce__(self):
        return (open, ("harmed", "w"))


def test_arrays_never_run_code(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for content in ({"a": Harmful()}, Harmful(), {"S1": {"a": [np.array([Harmful()], dtype=object)]}}):
        with pytest.raises(FormatError, match=r"holds .*open, and such objects can run code"):
            read(videopose3d(tmp_path / "a.npz", np.array(content, dtype=object)))
    assert not (tmp_path / "harmed").exists()


def test_freemocap(tmp_path):
    body = walker("mediapipe-33")
    hands = np.full((20, 42 + 478, 3), 300.0)
    whole = np.concatenate([body, hands], axis=1)
    other = np.concatenate([walker("mediapipe-33", shift=400), hands], axis=1)
    name = "mediapipe_2dData_numCams_numFrames_numTrackedPoints_pixelXY.npy"
    np.save(tmp_path / name, np.stack([whole, other])[..., :2])
    with pytest.raises(FormatError, match="shows 2 people"):
        read(tmp_path / name)
    np.testing.assert_allclose(read(tmp_path / name, person=0), expected("mediapipe-33"))
    np.testing.assert_allclose(read(tmp_path / name, person=1), expected("mediapipe-33", shift=400))
    np.save(tmp_path / "scored.npy", body)
    np.testing.assert_allclose(read(tmp_path / "scored.npy"), expected("mediapipe-33"))
    np.save(tmp_path / "mediapipe_body_3d_xyz.npy", body * [1, 1, 700])
    with pytest.raises(FormatError, match="has 3D points, such as FreeMoCap's spatialXYZ: take its 2D data"):
        read(tmp_path / "mediapipe_body_3d_xyz.npy")


@pytest.mark.parametrize(
    "array", [np.zeros(3), np.zeros((3, 17, 4)), np.array(["a"]), np.array({"a": 3}, dtype=object)]
)
def test_other_arrays_are_refused(tmp_path, array):
    np.save(tmp_path / "a.npy", array, allow_pickle=True)
    with pytest.raises(FormatError, match="must"):
        read(tmp_path / "a.npy")
    np.savez(tmp_path / "b.npz", keypoints=np.zeros((3, 17, 2)))
    with pytest.raises(FormatError, match="positions_2d"):
        read(tmp_path / "b.npz")


@settings(max_examples=120)
@given(st.data())
def test_damage_gives_a_format_error_or_points(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("damaged")
    paths = [
        deeplabcut(folder / "a.csv", [walker(frames=2)], list(COCO)),
        sleap(folder / "b.csv", [walker(frames=2)], ["x"]),
        videopose3d(folder / "c.npz", {"a": {"b": [walker(frames=2)[..., :2]]}}),
        yolo(folder / "labels", [walker(frames=2)]) / "clip one_8.txt",
    ]  # fmt: skip
    np.save(folder / "d.npy", walker(frames=2)[..., :2])
    path = data.draw(st.sampled_from([*paths, folder / "d.npy"]))
    raw = path.read_bytes()
    if path.suffix == ".npz":
        with zipfile.ZipFile(path) as archive:
            raw = archive.read("positions_2d.npy")
    for _ in range(data.draw(st.integers(1, 4))):
        at, word = (
            data.draw(st.integers(0, len(raw))),
            data.draw(st.binary(max_size=3) | st.sampled_from([b",", b"\n", b"9"])),
        )
        raw = raw[:at] + word + raw[at + data.draw(st.integers(0, 3)) :]
    if path.suffix == ".npz":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("positions_2d.npy", raw)
    else:
        path.write_bytes(raw)
    with suppress(MotionError):
        assert isinstance(read_points(path.parent if path.suffix == ".txt" else path, fps=25, size=None), Points)


@pytest.mark.parametrize(
    ("name", "says"),
    [("a.h5", "analyze_videos_converth5_to_csv.*Export Analysis CSV"), ("a.slp", "sleap-convert --format analysis.csv"),
     ("full.pickle", "can run code: export JSON or CSV"), ("a.mat", "must be keypoints")],
)  # fmt: skip
def test_files_that_cannot_be_read_are_told_what_to_do_with(tmp_path, name, says):
    (tmp_path / name).write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(FormatError, match=says):
        read(tmp_path / name)


@pytest.mark.parametrize(
    ("written", "name"),
    [("RHip", "right_hip"), ("LBigToe", "left_big_toe"), ("lankle", "left_ankle"), ("Hip", "mid_hip"), ("nose", "nose"),
     ("Head", "head_top"), ("hip.R", "right_hip"), ("ankle_left", "left_ankle"), ("CHip", "mid_hip"), ("tail", "tail"),
     ("RSHOULDER", "right_shoulder"), ("left_tail", "left_tail"), ("Neck", "neck"), ("RightUpLeg", "RightUpLeg")],
)  # fmt: skip
def test_names_of_keypoints(written, name):
    assert keypoint_name(written) == name


@pytest.mark.parametrize("kind", KEYPOINT_SETS)
def test_names_in_the_table_are_known(kind):
    names = [name for name in KEYPOINT_SETS[kind].keypoints if name]
    assert [keypoint_name(name) for name in names] == names


CORNER = {"both": (0.0, 0.0), "x": (0.0, 200.0)}


@pytest.mark.parametrize("score", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("at", CORNER)
def test_points_in_the_corner_are_missing_where_others_are_far(tmp_path, score, at):
    keypoints = walker()
    keypoints[3:9, COCO.index("left_knee")] = [*CORNER[at], score]
    found = np.isnan(read(deeplabcut(tmp_path / "a.csv", [keypoints], list(COCO))))
    assert found.all(-1)[3:9, 11].tolist() == [score == 0 or at == "both"] * 6
    assert found.sum() == (12 if score == 0 or at == "both" else 0)
    close = keypoints.copy()
    close[..., :2] -= close[3, COCO.index("right_knee"), :2] - [4, 0]  # of somebody who is there
    close[3:9, COCO.index("left_knee")] = [0, 0, 1]
    assert not np.isnan(read(deeplabcut(tmp_path / "b.csv", [close], list(COCO)))[3]).any()


def test_pixels_that_count_upwards(tmp_path):
    keypoints, truth = walker(), expected()
    keypoints[..., 1] = 720 - keypoints[..., 1]
    path = deeplabcut(tmp_path / "a.csv", [keypoints], list(COCO))
    np.testing.assert_allclose(read(path, up=True, size=SIZE), truth)
    shifted = read(path, up=True) - truth
    np.testing.assert_allclose(shifted, shifted[0, 0] * np.ones_like(truth), atol=1e-9)
    assert read(path, up=True)[..., 1].min() == 0
    write_points(Points(truth * [1, -1], 25, "px"), tmp_path / "b.csv")
    np.testing.assert_allclose(read(tmp_path / "b.csv", up=True, size=(640, 1)), truth + np.array([0, 1]))
    write_points(Points(truth * [0.01, -0.01], 25, "m"), tmp_path / "c.csv")
    with pytest.raises(MotionError, match="omit it"):
        read(tmp_path / "c.csv", up=True)
    folder = yolo(tmp_path / "labels", [keypoints])
    np.testing.assert_allclose(read(folder, up=True, size=SIZE), truth, atol=1e-5)


def test_pickles_of_older_versions(tmp_path):
    """Arrays that numpy 1 wrote under Python 2, of protocol 2, as Human3.6M's are shared."""
    written = np.array({"S1": {"Walking": [walker()[..., :2]]}}, dtype=object)
    stream = io.BytesIO()
    header = {"descr": "|O", "fortran_order": False, "shape": ()}
    np.lib.format.write_array_header_1_0(stream, header)
    stream.write(pickle.dumps(written, protocol=2).replace(b"numpy._core.multiarray", b"numpy.core.multiarray"))
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("positions_2d.npy", stream.getvalue())
    np.testing.assert_allclose(read(tmp_path / "a.npz"), expected())
