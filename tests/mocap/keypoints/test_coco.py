"""COCO keypoints in every layout: frames by number, name or image, people by place or track, damaged files."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import FormatError
from motionenv.mocap.keypoints import coco
from motionenv.mocap.keypoints.coco import KEYPOINTS
from tests.mocap.keypoints.detections import person, results, saved

HIP = KEYPOINTS.index("left_hip")


def test_keypoints_come_as_they_are_in_the_file(tmp_path):
    found = coco.read(saved(tmp_path, results(4)))
    assert found.shape == (4, 17, 3)
    for i in range(4):
        np.testing.assert_array_equal(found[i].ravel(), person(200 + i))


def test_frames_are_ordered_and_missing_ones_are_gaps(tmp_path):
    content = [c for c in results(12) if c["image_id"] not in (3, 4)][::-1]
    numbered = coco.read(saved(tmp_path, content))
    assert np.flatnonzero(np.isnan(numbered).all((1, 2))).tolist() == [3, 4]
    for entry in content:
        entry["image_id"] = f"walk2_{entry['image_id']}.jpg"
    np.testing.assert_array_equal(coco.read(saved(tmp_path, content)), numbered)


def test_a_data_set_has_a_frame_per_image(tmp_path):
    images = [{"id": 900 - i, "file_name": f"f{i}.png"} for i in range(12)]
    annotations = [
        {
            "image_id": 900 - i,
            "category_id": 1,
            "id": i,
            "keypoints": [v if j % 3 < 2 else 2 for j, v in enumerate(person(200 + i))],
        }
        for i in range(12)
        if i != 5
    ]
    annotations[0]["keypoints"][3 * KEYPOINTS.index("left_wrist") + 2] = 0
    annotations[1]["keypoints"][3 * KEYPOINTS.index("left_wrist") + 2] = 1
    found = coco.read(saved(tmp_path, {"images": images[::-1], "annotations": annotations}))
    assert np.flatnonzero(np.isnan(found).any((1, 2))).tolist() == [5]
    assert found[:2, KEYPOINTS.index("left_wrist"), 2].tolist() == [0, 1]
    assert (np.diff(found[6:, KEYPOINTS.index("left_knee"), 0]) == 1).all()


def two_people() -> list[dict]:
    """Two who pass each other, and one who shows up once."""
    out = [{"image_id": 5, "keypoints": person(900)}]
    for i in range(40):
        out.append({"image_id": i, "keypoints": person(100 + 5 * i, 0.8)})
        if i < 30:
            other = np.array(person(400 - 5 * i, 0.95))
            other[1::3] += 150
            out.append({"image_id": i, "keypoints": other.tolist()})
    return out


def test_several_people_are_asked_about_and_followed(tmp_path):
    path = saved(tmp_path, two_people())
    with pytest.raises(FormatError, match=r"shows 2 people.*person=.*0: 40 frames.*1: 30 frames"):
        coco.read(path)
    first, second = (coco.read(path, person=i) for i in (0, 1))
    assert (np.diff(first[:, HIP, 0]) == 5).all()
    assert (np.diff(second[:30, HIP, 0]) == -5).all()
    assert np.isnan(second[30:]).all()
    with pytest.raises(FormatError, match="no person 7"):
        coco.read(path, person=7)


def test_track_ids_say_who_is_who(tmp_path):
    content = [
        {"image_id": i, "keypoints": person(x + 400 * (i % 2)), "track_id": t}
        for i in range(9)
        for t, x in ((3, 1.0), (5, 2.0))
    ]
    where = coco.read(saved(tmp_path, content), person=1)[:, HIP, 0]
    assert sorted(np.abs(np.diff(where)).tolist()) == [400.0] * 8


DAMAGED = {
    "cut off": (json.dumps(results())[:300], "isn't complete JSON"),
    "empty": ("", "empty"),
    "nan": (json.dumps(results()).replace("0.9", "NaN", 1), "NaN"),
    "infinite": (json.dumps(results()).replace("0.9", "1e999", 1), "keypoints must be numbers"),
    "huge": (json.dumps(results()).replace("0.9", "9" * 5000, 1), "JSON"),
    "deep": ("[" * 100_000, "nested"),
    "a number": ("3", "list of results"),
    "no people": ([], "no person"),
    "no dicts": ([[1, 2]], "must be an object"),
    "short": (results(3, keypoints=[1.0, 2.0, 3.0]), "51 numbers"),
    "texts": (results(3, keypoints=["1"] * 51), "keypoints must be numbers"),
    "truths": (results(3, keypoints=[True] * 51), "keypoints must be numbers"),
    "nested": (results(3, keypoints=[[1, 2, 3]] * 17), "51 numbers"),
    "no keypoints": ([{"image_id": 1}], "51 numbers"),
    "no image": ([{"keypoints": person()}], "image_id"),
    "wordy image": (results(3, image_id="frame"), "number of a frame"),
    "cats": (results(3, category_id=17), "no person"),
    "bomb": ([*results(3), *results(1, image_id=10**15)], "span"),
    "long": (results(1) + results(1, image_id=-(10**30)), "span"),
    "no images": ({"annotations": []}, '"images"'),
    "images": ({"images": [3], "annotations": []}, r"images\[0\]"),
    "stranger": ({"images": [{"id": 1}], "annotations": results(3)}, "no image has the id 0"),
    "twice": ({"images": [{"id": 1}, {"id": 1}], "annotations": results(3)}, "same id"),
    "crowd": (results(1) * 101, "101 people"),
    "track": (results(3, track_id=[1]), "track_id"),
    "track twice": (results(1, track_id=1) * 2, "twice in frame"),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_json_says_what_is_wrong(tmp_path, damage):
    content, says = DAMAGED[damage]
    with pytest.raises(FormatError, match=says) as error:
        coco.read(saved(tmp_path, content))
    assert "a.json" in str(error.value)
    assert len(str(error.value)) < 500


@settings(max_examples=60)
@given(
    st.recursive(
        st.none() | st.booleans() | st.floats(-1e6, 1e6) | st.integers() | st.text(max_size=3),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(
                    ["image_id", "keypoints", "images", "annotations", "categories", "id", "category_id", "track_id"]
                ),
                inner,
            )
        ),
    )
)
def test_any_json_gives_a_format_error(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("any") / "a.json"
    path.write_text(json.dumps(content))
    with pytest.raises(FormatError):
        coco.read(path)


def test_somebody_who_is_lost_for_a_while_is_the_same_and_for_long_is_another(tmp_path):
    for gap, people in ((30, 1), (31, 2)):
        content = [entry for entry in results(100) if not 40 <= entry["image_id"] < 39 + gap]
        path = saved(tmp_path, content)
        if people == 1:
            assert np.isfinite(coco.read(path)[[0, 99]]).all()
        else:
            with pytest.raises(FormatError, match="shows 2 people"):
                coco.read(path)
