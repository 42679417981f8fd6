"""People in JSON in every layout: frames by number, name or image, people by place or track, damaged files."""

import json
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.errors import FormatError
from motionenv.mocap.keypoints import detections
from motionenv.mocap.keypoints.people import chosen
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from tests.mocap.keypoints.people_json import person, results, saved, walker

KEYPOINTS = KEYPOINT_SETS["coco-17"].keypoints
HIP = KEYPOINTS.index("left_hip")


def read_one(path, person: int | None = None) -> np.ndarray:
    """Keypoints (frames, n, 3) of one person in a file."""
    found = detections.read(path)
    return detections.in_frames(chosen(path, found.tracks, person), found.frames)


def test_keypoints_come_as_they_are_in_the_file(tmp_path):
    found = read_one(saved(tmp_path, results(4)))
    assert found.shape == (4, 17, 3)
    for i in range(4):
        np.testing.assert_array_equal(found[i].ravel(), person(200 + i))


def test_frames_are_ordered_and_missing_ones_are_gaps(tmp_path):
    content = [c for c in results(12) if c["image_id"] not in (3, 4)][::-1]
    numbered = read_one(saved(tmp_path, content))
    assert np.flatnonzero(np.isnan(numbered).all((1, 2))).tolist() == [3, 4]
    for entry in content:
        entry["image_id"] = f"walk2_{entry['image_id']}.jpg"
    np.testing.assert_array_equal(read_one(saved(tmp_path, content)), numbered)


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
    found = read_one(saved(tmp_path, {"images": images[::-1], "annotations": annotations}))
    assert np.flatnonzero(np.isnan(found).any((1, 2))).tolist() == [5]
    assert found[:2, KEYPOINTS.index("left_wrist"), 2].tolist() == [0, 0.5]
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
        read_one(path)
    first, second = (read_one(path, person=i) for i in (0, 1))
    assert (np.diff(first[:, HIP, 0]) == 5).all()
    assert (np.diff(second[:30, HIP, 0]) == -5).all()
    assert np.isnan(second[30:]).all()
    with pytest.raises(FormatError, match="no person 7"):
        read_one(path, person=7)


def test_track_ids_say_who_is_who(tmp_path):
    content = [
        {"image_id": i, "keypoints": person(x + 40 * (i % 2)), "track_id": t}
        for i in range(9)
        for t, x in ((3, 1.0), (5, 2.0))
    ]
    where = read_one(saved(tmp_path, content), person=1)[:, HIP, 0]
    assert sorted(np.abs(np.diff(where)).tolist()) == [40.0] * 8


DAMAGED = {
    "cut off": (json.dumps(results())[:300], "isn't complete JSON"),
    "empty": ("", "empty"),
    "nan": (json.dumps(results()).replace("0.9", "Infinity", 1), "Infinity"),
    "infinite": (json.dumps(results()).replace("0.9", "1e999", 1), "keypoints must be numbers"),
    "huge": (json.dumps(results()).replace("0.9", "9" * 5000, 1), "JSON"),
    "deep": ("[" * 100_000, "nested"),
    "a number": ("3", "list of detections"),
    "no people": ([], "no person"),
    "no dicts": ([[1, 2]], "must list the people"),
    "no list": ([1, 2], "must have people"),
    "one frame": ({"people": [{"pose_keypoints_2d": person()}]}, "the folder"),
    "mixed": (results(2) + results(1, image_id=5, keypoints=person() * 2), "17 and 34 keypoints"),
    "short": (results(3, keypoints=[1.0, 2.0, 3.0, 4.0]), "keypoints must be numbers"),
    "texts": (results(3, keypoints=["1"] * 51), "keypoints must be numbers"),
    "truths": (results(3, keypoints=[True] * 51), "keypoints must be numbers"),
    "nested": (results(3, keypoints=[[1, 2, 3]] * 16 + [[1, 2]]), "keypoints must be numbers"),
    "no keypoints": ([{"image_id": 1}], "keypoints must be numbers"),
    "no image": ([{"keypoints": person()}], "image_id"),
    "wordy image": (results(3, image_id="frame"), "number of a frame"),
    "cats": (results(3, category_id=17), "no person"),
    "bomb": ([*results(3), *results(1, image_id=10**15)], "span"),
    "long": (results(1) + results(1, image_id=-(10**30)), "span"),
    "no images": ({"annotations": []}, '"images"'),
    "images": ({"images": [3], "annotations": []}, "each with an"),
    "stranger": ({"images": [{"id": 1}], "annotations": results(3)}, "0 is missing"),
    "twice": ({"images": [{"id": 1}, {"id": 1}], "annotations": results(1, image_id=1)}, "same id"),
    "crowd": (results(1) * 101, "101 people"),
    "track twice": (results(1, track_id=1) * 2, "twice in frame"),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_json_says_what_is_wrong(tmp_path, damage):
    content, says = DAMAGED[damage]
    with pytest.raises(FormatError, match=says) as error:
        read_one(saved(tmp_path, content))
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
                    [
                        "image_id",
                        "keypoints",
                        "images",
                        "annotations",
                        "categories",
                        "id",
                        "category_id",
                        "track_id",
                        "frame",
                        "instances",
                        "people",
                        "landmarks",
                        "x",
                        "y",
                        "visible",
                        "keypoint_scores",
                        "idx",
                    ]
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
        read_one(path)


def test_somebody_who_is_lost_for_a_while_is_the_same_and_for_long_is_another(tmp_path):
    for gap, people in ((30, 1), (31, 2)):
        content = [entry for entry in results(100) if not 40 <= entry["image_id"] < 39 + gap]
        path = saved(tmp_path, content)
        if people == 1:
            assert np.isfinite(read_one(path)[[0, 99]]).all()
        else:
            with pytest.raises(FormatError, match="shows 2 people"):
                read_one(path)


FRAMES = 12


def openpose(people, **more) -> dict:
    """A frame as OpenPose 1.3 writes it."""
    empty = {key: [] for key in ("face_keypoints_2d", "hand_left_keypoints_2d", "pose_keypoints_3d")}
    return {"version": 1.3, "people": [{"person_id": [-1], "pose_keypoints_2d": k.ravel().tolist(), **empty, **more}
                                       for k in people]}  # fmt: skip


def mmpose(people) -> list:
    return [{"keypoints": k[:, :2].tolist(), "keypoint_scores": k[:, 2].tolist(), "bbox": [[0, 0, 1, 1]],
             "bbox_score": 0.9} for k in people]  # fmt: skip


def ultralytics(people, ids=None) -> list:
    rows = [dict(zip("xy", k[:, :2].T.tolist(), strict=True), visible=k[:, 2].tolist()) for k in people]
    named = [{"track_id": i} for i in ids] if ids else [{}] * len(rows)
    return [{"name": "person", "class": 0, "confidence": 0.9, "box": {"x1": 0.0}, **name, "keypoints": row}
            for row, name in zip(rows, named, strict=True)]  # fmt: skip


def mediapipe(k) -> list:
    return [{"x": x, "y": y, "z": -0.1, "visibility": v, "presence": 0.9} for x, y, v in k.tolist()]


LAYOUTS = {
    "MMPose inferencer": lambda films: [{"frame_id": i, "instances": mmpose(p)} for i, p in enumerate(films)],
    "MMPose demo": lambda films: {
        "meta_info": {"dataset_name": "coco", "keypoint_id2name": {"0": "nose"}},
        "instance_info": [{"frame_id": i + 1, "instances": mmpose(p)} for i, p in enumerate(films)],
    },
    "AlphaPose": lambda films: [
        {"image_id": f"{i}.jpg", "category_id": 1, "keypoints": k.ravel().tolist(), "score": 2.9, "box": [1, 2, 3, 4],
         "idx": [0.0]} for i, p in enumerate(films) for k in p
    ],
    "Ultralytics": lambda films: [ultralytics(p) for p in films],
    "Ultralytics API": lambda films: {"images": [{"results": ultralytics(p), "shape": [480, 640]} for p in films]},
    "MediaPipe": lambda films: [{"frame": i, "landmarks": [mediapipe(k) for k in p]} for i, p in enumerate(films)],
    "landmarks": lambda films: {"fps": 25, "frames": [{"frame": i, "pose_landmarks": mediapipe(p[0])}
                                                      for i, p in enumerate(films)]},
}  # fmt: skip


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_keypoints_that_were_written(tmp_path, layout):
    whole = walker("halpe-26", FRAMES)
    path = saved(tmp_path, LAYOUTS[layout]([[k] for k in whole]))
    np.testing.assert_array_equal(read_one(path), whole)


@pytest.mark.parametrize("layout", [name for name in LAYOUTS if name != "landmarks"])
def test_in_every_layout_people_are_kept_apart_and_empty_frames_are_gaps(tmp_path, layout):
    one, two = walker("coco-17", FRAMES), walker("coco-17", FRAMES, shift=600, score=0.7)
    films = [[a, b] if i % 2 else [b, a] for i, (a, b) in enumerate(zip(one, two, strict=True))]
    films[5] = []
    path = saved(tmp_path, LAYOUTS[layout](films))
    with pytest.raises(FormatError, match="shows 2 people"):
        read_one(path)
    for person_, truth in ((0, one), (1, two)):
        found = read_one(path, person_)
        assert np.isnan(found[5]).all()
        np.testing.assert_array_equal(np.delete(found, 5, axis=0), np.delete(truth, 5, axis=0))


def test_a_folder_has_a_frame_per_file(tmp_path):
    one, two = walker("body-25", FRAMES), walker("body-25", FRAMES, shift=600, score=0.7)
    for i in range(FRAMES):
        people = [] if i == 4 else [two[i], one[i]]
        (tmp_path / f"cam01_{i + 8:012d}_keypoints.json").write_text(json.dumps(openpose(people)))
    found = read_one(tmp_path, 0)
    assert np.isnan(found[4]).all()
    np.testing.assert_array_equal(np.delete(found, 4, axis=0), np.delete(one, 4, axis=0))
    (tmp_path / "cam02_000000000009_keypoints.json").write_text(json.dumps(openpose([])))
    with pytest.raises(FormatError, match="13 files or images have 12 numbers"):
        read_one(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(FormatError, match="got 0 files"):
        read_one(tmp_path / "empty")


def test_folders_of_ultralytics_and_of_mediapipe(tmp_path):
    whole = walker("mediapipe-33", FRAMES)
    for kind in ("ultralytics", "mediapipe"):
        folder = tmp_path / kind
        folder.mkdir()
        for i, k in enumerate(whole):
            content = ultralytics([k]) if kind == "ultralytics" else mediapipe(k)
            (folder / f"frame_{i:05d}.json").write_text(json.dumps(content))
        np.testing.assert_array_equal(read_one(folder), whole)


def test_identities_win_over_places_and_those_that_mean_nobody_do_not_count(tmp_path):
    one, two = walker("coco-17", FRAMES), walker("coco-17", FRAMES, shift=600)
    near = walker("coco-17", FRAMES, shift=60)
    films = [ultralytics([b, a] if i == 6 else [a, b], [1, 2]) for i, (a, b) in enumerate(zip(one, near, strict=True))]
    crossed = read_one(saved(tmp_path, films), 0)
    np.testing.assert_array_equal(crossed[6], near[6])
    for i, k in enumerate(one):
        named = openpose([k], person_id=[-1])["people"] + openpose([two[i]], person_id=[-1])["people"]
        (tmp_path / f"cam.{i:04d}.json").write_text(json.dumps({"people": named}))
    (tmp_path / "a.json").unlink()
    np.testing.assert_array_equal(read_one(tmp_path, 0), one)


def test_points_that_are_nan_have_no_score(tmp_path):
    whole = walker("halpe-26", FRAMES)
    whole[3, 9] = np.nan
    for i, k in enumerate(whole):
        (tmp_path / f"cam01_{i:06d}.json").write_text(json.dumps(openpose([k])))
    found = read_one(tmp_path)
    assert found[3, 9, 2] == 0
    np.testing.assert_array_equal(np.delete(found, 3, axis=0), np.delete(whole, 3, axis=0))


@settings(max_examples=150)
@given(st.data())
def test_damage_to_any_layout_gives_a_format_error_or_keypoints(tmp_path_factory, data):
    films = [[k] for k in walker(frames=3)]
    annotations = [{"image_id": 4, "category_id": 1, "keypoints": films[0][0].ravel().tolist()}]
    images, categories = [{"id": 4, "file_name": "a.png"}], [{"id": 1, "name": "person"}]
    dataset = {"images": images, "categories": categories, "annotations": annotations}
    layouts = [*(LAYOUTS[name](films) for name in LAYOUTS), dataset]
    content = data.draw(st.sampled_from(layouts))
    for _ in range(data.draw(st.integers(1, 3))):  # replace a part of the tree by something else
        at, key = None, None
        inner = content
        while isinstance(inner, dict | list) and inner and (at is None or data.draw(st.booleans())):
            at = inner
            key = data.draw(st.sampled_from(sorted(at) if isinstance(at, dict) else range(len(at))))
            inner = at[key]
        if at is not None:
            at[key] = data.draw(
                st.sampled_from([None, [], {}, "", "x", -1, True, 1e30, 10**30, [1], [[]], [{}], {"x": 1}, [{"x": []}]])
            )
    path = tmp_path_factory.mktemp("damaged") / "a.json"
    path.write_text(json.dumps(content))
    with suppress(FormatError):
        found = read_one(path)
        assert found.ndim == 3
        assert found.shape[2] == 3


@pytest.mark.parametrize("form", ["entry", "people", "keypoints"])
def test_frames_of_nobody_may_be_null(tmp_path, form):
    """As MediaPipe's `pose_landmarks`, which are None, are dumped."""
    of = {
        "entry": lambda i, points: points and [{"keypoints": points}],
        "people": lambda i, points: {"frame": i, "people": points and [{"keypoints": points}]},
        "keypoints": lambda i, points: {"frame": i, "keypoints": points},
    }[form]
    found = read_one(saved(tmp_path, [of(i, None if i == 2 else person(200 + i)) for i in range(5)]))
    assert np.flatnonzero(np.isnan(found).all((1, 2))).tolist() == [2]
    np.testing.assert_array_equal(found[3].ravel(), person(203))


@pytest.mark.parametrize("columns", [2, 3])
def test_keypoints_may_be_a_list_of_each(tmp_path, columns):
    points = [np.reshape(person(200 + i), (17, 3)) for i in range(4)]
    content = [{"image_id": i, "keypoints": one[:, :columns].tolist()} for i, one in enumerate(points)]
    found = read_one(saved(tmp_path, content))
    np.testing.assert_array_equal(found[:, :, :columns], np.array(points)[:, :, :columns])
    assert columns == 3 or (found[:, :, 2] == 1).all()
