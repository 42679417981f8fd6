import json
from functools import partial

import numpy as np
import pytest
from PIL import Image
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from motionenv.data import Sampler, generate
from motionenv.data.formats.coco import KEYPOINTS, run_lengths
from motionenv.errors import MotionError
from motionenv.types import MARKERS
from tests.data.walks import EVERYTHING, SINGLE

WITH_FACES = SINGLE.replace(output={"picture": "png"})


def shown(sample: dict, frame, name: str) -> np.ndarray:
    return sample[name][frame]


@pytest.fixture(scope="module", params=["clips", "single"])
def made(request, tmp_path_factory):
    spec = EVERYTHING if request.param == "clips" else WITH_FACES
    folder = tmp_path_factory.mktemp("coco")
    assert generate(spec, folder, format="coco", workers=1).complete
    return spec, folder, COCO(folder / "annotations" / "person_keypoints.json")


def lands_on(image: dict, person: dict, pixels: np.ndarray) -> bool:
    """Whether somebody has joints; if so they are seen where the picture's camera puts them."""
    if "joints" not in person:
        return False
    seen = (np.array(person["joints"]) @ np.array(image["R"]).T + image["t"]) @ np.array(image["K"]).T
    np.testing.assert_allclose((seen / seen[:, 2:])[:, :2], pixels, atol=0.01)
    return True


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
def test_pycocotools_finds_the_truth(made):
    spec, folder, coco = made
    sampler, annotated, with_joints = Sampler(spec), 0, 0
    assert len(coco.imgs) == spec.samples * spec.clip
    for number, image in coco.imgs.items():
        index, frame = divmod(number - 1, spec.clip)
        sample = sampler.sample(index)
        assert (image["clip"], image["frame"]) == (index, frame)
        at = partial(shown, sample, frame if spec.clip > 1 else ...)
        assert np.array_equal(np.asarray(Image.open(folder / image["file_name"])), at("rgb"))
        for one in coco.loadAnns(coco.getAnnIds(number)):
            who = one["id"] % 16
            mask = at("people") == 1 + who
            assert np.array_equal(coco.annToMask(one), mask)
            x, y, w, h = one["bbox"]
            assert mask.sum() == mask[y : y + h, x : x + w].sum() == one["area"]
            assert mask[y].any()
            assert mask[:, x + w - 1].any()
            if who == 0:
                points = np.array(one["markers"]).reshape(15, 3)
                assert np.array_equal(points[:, 2], at("visibility"))
                inside = points[:, 2] > 0
                np.testing.assert_allclose(points[inside, :2], at("pixels")[inside], atol=0.0051)
                knee = np.array(one["keypoints"]).reshape(17, 3)[KEYPOINTS.index("left_knee")]
                assert np.array_equal(knee, points[MARKERS.index("left_knee")])
                face = np.where(at("face")[:, 2:] > 0, at("face"), 0)
                np.testing.assert_allclose(np.array(one["keypoints"][:15]).reshape(5, 3), face, atol=0.0051)
                assert one["walker"] == sample["walker"]
                with_joints += lands_on(image, one, at("pixels"))
            annotated += 1
        assert len(coco.getAnnIds(number)) == len(np.unique(at("people"))) - (0 in at("people"))
    assert annotated > len(coco.imgs)  # passers-by have theirs
    assert bool(with_joints) == ("joints" in spec.output.fields)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_truth_matches_itself(made):
    _, folder, coco = made
    people = [dict(one, score=1.0) for one in coco.anns.values() if one["num_keypoints"] > 0]
    found = coco.loadRes([{k: one[k] for k in ("image_id", "category_id", "keypoints", "score")} for one in people])
    judged = COCOeval(coco, found, "keypoints")
    judged.evaluate()
    anywhere = judged.evalImgs[: len(coco.imgs)]  # of any size
    judged.accumulate()
    judged.summarize()
    assert judged.stats[0] == 1  # AP of a perfect detector
    for one in anywhere:
        if one is not None:
            assert (one["gtMatches"][-1][~one["gtIgnore"].astype(bool)] > 0).all()  # at an OKS of 0.95
    assert len(people) > len(coco.imgs)
    assert json.loads((folder / "dataset.json").read_text())["format"] == "coco"


def test_what_coco_lacks_is_named(tmp_path):
    with pytest.raises(MotionError, match="format coco needs people, face, others among output.fields, too"):
        generate(SINGLE.replace(output={"fields": ["rgb", "pixels", "visibility"]}), tmp_path, format="coco")
    assert not list(tmp_path.iterdir())


def test_run_lengths():
    mask = np.array([[1, 0, 1], [1, 0, 0]], bool)
    assert run_lengths(mask) == [0, 2, 2, 1, 1]
    assert run_lengths(~mask) == [2, 2, 1, 1]
    assert run_lengths(np.zeros((2, 2), bool)) == [4]
