"""Definitions of keypoints: the tables' orders, what becomes of them, which one fits, what the CMU set taught."""

import numpy as np
import pytest

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS, keypoint_set
from motionenv.types import MARKERS
from tests.mocap.keypoints.people_json import expected, walker

SIDES = [m for m, name in enumerate(MARKERS) if "_" in name]


@pytest.mark.parametrize("name", KEYPOINT_SETS)
def test_every_definition_is_recognised_and_gives_the_markers(name):
    keypoints = walker(name)
    known = keypoint_set("a.json", keypoints)
    assert known.name == name
    assert keypoint_set("a.json", keypoints, name) is known
    positions, confidence = known.markers(keypoints, 0.3)
    np.testing.assert_allclose(positions, expected(name), atol=1e-9)
    np.testing.assert_allclose(confidence, 0.9)
    named = [keypoint for keypoint in known.keypoints if keypoint]
    assert len(set(named)) == len(named)
    assert len(known.keypoints) == int(name.split("-")[-1].rstrip("b"))
    assert np.isfinite(known.spread).all()
    assert (known.spread < 0.04).all()


@pytest.mark.parametrize("name", KEYPOINT_SETS)
def test_files_list_keypoints_where_the_tools_documents_say(name):
    """Places from the documents of COCO, OpenPose, Halpe, MediaPipe and VideoPose3D."""
    places = {
        "coco-17": {"left_shoulder": 5, "right_wrist": 10, "right_ankle": 16},
        "coco-wholebody-133": {"right_ankle": 16},
        "halpe-26": {"right_knee": 14, "head_top": 17, "neck": 18, "mid_hip": 19, "right_heel": 25},
        "halpe-136": {"mid_hip": 19},
        "body-25": {"neck": 1, "right_shoulder": 2, "mid_hip": 8, "left_ankle": 14, "right_ear": 17, "left_heel": 21},
        "body-25b": {"left_hip": 11, "upper_neck": 17, "head_top": 18, "left_big_toe": 19, "right_heel": 24},
        "human36m-17": {"right_hip": 1, "left_hip": 4, "head_top": 10, "left_shoulder": 11, "right_wrist": 16},
        "mediapipe-33": {"left_ear": 7, "left_shoulder": 11, "right_wrist": 16, "left_hip": 23, "right_ankle": 28},
    }
    for keypoint, place in places[name].items():
        assert KEYPOINT_SETS[name].keypoints.index(keypoint) == place


def test_a_marker_is_as_sure_as_its_least_sure_keypoint_and_never_surer_than_1():
    known = KEYPOINT_SETS["coco-17"]
    keypoints = walker(score=1.4)
    keypoints[:, known.keypoints.index("left_hip"), 2] = 0.4
    _, confidence = known.markers(keypoints, 0.3)
    for marker, sure in (("pelvis", 0.4), ("sternum", 0.4), ("left_hip", 0.4), ("right_hip", 1.0), ("head", 1.0)):
        np.testing.assert_allclose(confidence[:, MARKERS.index(marker)], sure)
    positions, confidence = known.markers(keypoints, 0.5)
    gone = np.isnan(positions).any(axis=(0, 2))
    assert {MARKERS[m] for m in np.flatnonzero(gone)} == {"pelvis", "sternum", "left_hip"}
    assert (confidence[:, gone] == 0).all()


def test_without_ears_the_head_lies_between_neck_and_top():
    known, keypoints = KEYPOINT_SETS["halpe-26"], walker("halpe-26")
    for ear in ("left_ear", "right_ear"):
        keypoints[5, known.keypoints.index(ear), 2] = 0
    positions, _ = known.markers(keypoints, 0.3)
    np.testing.assert_allclose(positions[5], expected("halpe-26")[5], atol=1e-9)


def test_definitions_are_recognised_by_parts_of_a_person():
    for name in ("coco-17", "human36m-17", "body-25", "body-25b"):
        for parts in (("shoulder", "elbow", "wrist", "hip"), ("shoulder", "hip", "knee", "ankle")):
            keypoints = walker(name)
            hidden = [not key.endswith(parts) for key in KEYPOINT_SETS[name].keypoints]
            keypoints[:, hidden, 2] = 0
            assert keypoint_set("a.json", keypoints).name == name, parts
    unseen = walker()
    unseen[..., 2] = 0
    assert keypoint_set("a.json", unseen).name == "coco-17"


def test_a_wrong_number_of_keypoints_is_told_with_the_known_ones():
    with pytest.raises(FormatError, match=r"a\.json: has 18 keypoints .* 26 \(halpe-26\)"):
        keypoint_set("a.json", np.zeros((3, 18, 3)))
    with pytest.raises(FormatError, match=r"has 17 keypoints for a person, expected 25 \(body-25\)"):
        keypoint_set("a.json", walker(), "body-25")
    with pytest.raises(MotionError, match="format must be one of coco-17"):
        keypoint_set("a.json", walker(), "coco")


def test_the_sternum_is_where_cmu_walkers_have_theirs(mocap):
    """One trial of each of the 13 subjects; the table has the mean of their least-squares fractions."""
    from motionenv.mocap import read, to_markers

    known, fractions, missed = KEYPOINT_SETS["coco-17"], [], []
    weights = known.ways("sternum")[0]["of"]
    for folder in sorted((mocap / "cmu_asfamc").iterdir()):
        if folder.name in ("26", "27", "29", "46") or not folder.is_dir():  # these turn
            continue
        at = np.moveaxis(to_markers(read(min(folder.glob("*.amc")), fps=120)).positions, 1, 0)
        p = dict(zip(MARKERS, at, strict=True))
        shoulders, hips = ((p[f"left_{part}"] + p[f"right_{part}"]) / 2 for part in ("shoulder", "hip"))
        down, off = hips - shoulders, p["sternum"] - shoulders
        fractions.append((off * down).sum() / (down**2).sum())
        made = sum(weight * p[name] for name, weight in weights.items())
        height = np.median(np.linalg.norm(down, axis=-1)) / 0.288  # `from_height`: shoulders above hips
        missed.append(np.mean(np.sum((made - p["sternum"]) ** 2, axis=-1)) / height**2)
    assert len(fractions) == 13
    assert 2 * weights["left_hip"] == pytest.approx(np.mean(fractions), abs=0.005)
    assert known.spread[MARKERS.index("sternum")] == pytest.approx(np.sqrt(np.mean(missed)), abs=0.002)


@pytest.mark.parametrize(
    ("name", "indices"),
    [
        ("halpe-26", (24, 20, 25, 21)), ("body-25", (21, 19, 24, 22)), ("mediapipe-33", (29, 31, 30, 32)),
        ("coco-wholebody-133", (19, 17, 22, 20)),
    ],
)  # fmt: skip
def test_heels_and_toes_are_those_of_the_publications(name, indices):
    """Left heel and big toe, right heel and big toe; what scores little is a gap."""
    known = KEYPOINT_SETS[name]
    keypoints = np.random.default_rng(0).uniform(1, 100, (3, len(known.keypoints), 3))
    keypoints[..., 2] = 0.9
    keypoints[1, indices[0], 2] = 0.1
    feet = known.feet(keypoints, 0.3)
    expected = keypoints[:, list(indices), :2].copy()
    expected[1, 0] = np.nan
    np.testing.assert_array_equal(feet, expected)
    assert KEYPOINT_SETS["coco-17"].feet(keypoints[:, :17], 0.3) is None
