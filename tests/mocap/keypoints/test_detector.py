"""RTMPose by RTMLib, run for real on models so small that they are made here: they find coloured dots."""

import sys

import numpy as np
import pytest

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.detector import detect_people, detector
from motionenv.mocap.keypoints.points2d import points_of
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.types import MARKERS

pytest.importorskip("rtmlib", reason="RTMLib is missing: pip install -e '.[integrations]'")
onnx = pytest.importorskip("onnx", reason="onnx is missing: pip install -e '.[integrations]'")
from onnx import TensorProto, helper, numpy_helper  # noqa: E402

HALPE = KEYPOINT_SETS["halpe-26"].keypoints
SIDE, WIDE, TALL = 64, 48, 64  # of the detector's and of the pose model's pictures


def saved(path, nodes, inputs, outputs, constants) -> str:
    """An ONNX file of the `nodes`."""
    initial = [numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()]
    values = [[helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in some] for some in (inputs, outputs)]
    model = helper.make_model(helper.make_graph(nodes, "made", *values, initial), ir_version=8,
                              opset_imports=[helper.make_opsetid("", 17)])  # fmt: skip
    onnx.save(model, str(path))
    return str(path)


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A detector of the whole picture if anything in it is bright, and of each keypoint at a dot of its part's colour.

    The head's keypoints are at the brightest blue, those of feet, knees and ankles at the brightest red, all others at
    the brightest green.
    """
    folder = tmp_path_factory.mktemp("weights")
    saved(
        folder / "yolox.onnx",
        [
            helper.make_node("ReduceMax", ["picture"], ["most"], axes=[1, 2, 3], keepdims=1),
            helper.make_node("Greater", ["most", "bright"], ["is"]),
            helper.make_node("Cast", ["is"], ["score4"], to=TensorProto.FLOAT),
            helper.make_node("Reshape", ["score4", "flat"], ["score"]),
            helper.make_node("Concat", ["box", "score"], ["found"], axis=2),
        ],
        [("picture", [1, 3, SIDE, SIDE])], [("found", [1, 1, 5])],
        {"bright": np.float32([[[[200]]]]), "flat": np.int64([1, 1, 1]), "box": np.float32([[[0, 0, SIDE, SIDE]]])},
    )  # fmt: skip
    blue = ("nose", "eye", "ear", "head", "neck")
    red = ("knee", "ankle", "toe", "heel")
    parts = [0 if any(b in k for b in blue) else 2 if any(r in k for r in red) else 1 for k in HALPE]
    nodes = []
    for axis, over in (("x", 2), ("y", 3)):  # SimCC: as many bins as half pixels
        nodes += [
            helper.make_node("ReduceMax", ["picture"], [f"most_{axis}"], axes=[over], keepdims=0),
            helper.make_node("Gather", [f"most_{axis}", "parts"], [f"part_{axis}"], axis=1),
            helper.make_node("Resize", [f"part_{axis}", "", "twice"], [axis], mode="nearest"),
        ]
    saved(
        folder / "pose.onnx", nodes, [("picture", [1, 3, TALL, WIDE])],
        [("x", [1, 26, 2 * WIDE]), ("y", [1, 26, 2 * TALL])],
        {"parts": np.int64(parts), "twice": np.float32([1, 1, 2])},
    )  # fmt: skip
    return folder


DOTS = {"head": (30, 14, 2), "pelvis": (34, 40, 1), "left_ankle": (40, 70, 0)}  # column, row, channel of RGB


def film(frames: int) -> list[np.ndarray]:
    """Pictures of 96 × 96 pixels with three dots that move to the right; nothing in the middle picture."""
    pictures = []
    for t in range(frames):
        picture = np.zeros((96, 96, 3), dtype=np.uint8)
        for column, row, channel in DOTS.values() if t != frames // 2 else ():
            picture[row - 1 : row + 2, column + 2 * t - 1 : column + 2 * t + 2, channel] = 255
        pictures.append(picture)
    return pictures


def test_every_keypoint_is_where_the_models_see_it_in_the_films_pixels(weights, capsys):
    told = []
    tracks, frames = detect_people(film(7), detector("rtmpose", weights), on_progress=told.append)
    assert (frames, told, len(tracks)) == (7, list(range(1, 8)), 1)
    assert sorted(tracks[0]) == [0, 1, 2, 4, 5, 6]  # not the whole picture where the detector sees nobody
    assert tracks[0][0].shape == (26, 3)
    (points,) = points_of("film.mp4", tracks, frames, 25.0)
    for name, (column, row, _) in DOTS.items():
        expected = np.column_stack([column + 2.0 * np.arange(7), np.full(7, row)])
        expected[3] = np.nan
        np.testing.assert_allclose(points.positions[:, MARKERS.index(name)], expected, atol=2.5)
    assert (points.confidence[0] > 0.9).all()
    assert capsys.readouterr().out == ""


def test_an_empty_film_and_weights_of_nothing(weights, tmp_path):
    dark, seen_by = [np.zeros((96, 96, 3), dtype=np.uint8)] * 2, detector("rtmpose", weights)
    with pytest.raises(FormatError, match="nobody in 2 frames"):
        detect_people(dark, seen_by, name="dark.mp4")
    for content in (None, "no model"):
        if content is not None:
            for name in ("yolox.onnx", "pose.onnx"):
                (tmp_path / name).write_text(content)
        with pytest.raises(MotionError, match="are of no use: they must be a folder.*ONNX file of YOLOX"):
            detector("rtmpose", tmp_path)


def test_without_a_network_the_message_says_what_else_to_do(monkeypatch, tmp_path):
    monkeypatch.setenv("TORCH_HOME", str(tmp_path))  # no weights of earlier downloads
    for name in ("http_proxy", "https_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:9")  # nothing listens there
    with pytest.raises(MotionError, match="weights can't be downloaded.*--weights"):
        detector("rtmpose")


def test_without_rtmlib_the_message_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "rtmlib", None)
    with pytest.raises(MotionError, match=r"motionenv\[rtmpose\].*OpenPose, MMPose"):
        detector("rtmpose")
