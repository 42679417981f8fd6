import json

import mlcroissant
import numpy as np
import pytest

from motionenv.data import Sampler, generate
from motionenv.data.formats.card import card, describe
from tests.data.walks import EVERYTHING, SINGLE


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    generate(EVERYTHING, folder, workers=1)
    return folder


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning", "ignore::UserWarning")  # of rdflib
def test_mlcroissant_accepts_it_and_reads_the_truth(made):
    read = mlcroissant.Dataset(jsonld=made / "croissant.json")
    assert not read.metadata.ctx.issues.errors
    record = next(iter(read.records("records/index/shard-000001.parquet")))
    sample = Sampler(EVERYTHING).sample(3)
    found = {name.rsplit("/", 1)[-1]: value for name, value in record.items()}
    assert found["index"] == 3
    np.testing.assert_array_equal(np.array(list(found["joints"]), dtype=float).reshape(6, 15, 3), sample["joints"])


def test_every_file_is_in_it(made):
    listed = json.loads((made / "croissant.json").read_text())["distribution"]
    named = {one["contentUrl"] for one in listed}
    files = {str(file.relative_to(made)) for folder in ("shards", "index") for file in (made / folder).iterdir()}
    assert named == files
    assert all(len(one["sha256"]) == 64 for one in listed)


def test_the_card_says_how_to_make_it_again(made):
    from huggingface_hub import DatasetCard

    text = (made / "README.md").read_text()
    assert text == card(EVERYTHING, "webdataset")
    assert DatasetCard(text).data.size_categories == ["n<1K"]
    assert "| `others_joints` | (2, 6, 15, 3) | sc:Float |" in text
    assert "motionenv dataset make dataset.json --format webdataset --out FOLDER" in text
    assert json.loads(text.split("```json")[1].split("```")[0]) == json.loads(EVERYTHING.json())
    assert "single pictures" in card(SINGLE.replace(frames=5_000_000), "coco")
    assert "1M<n<10M" in card(SINGLE.replace(frames=5_000_000), "coco")
    assert describe.__doc__
