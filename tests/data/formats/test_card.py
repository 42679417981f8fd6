"""The card of a data set, read by Hugging Face's library."""

import json

from motionenv.data import generate
from motionenv.data.formats.card import card
from tests.data.walks import EVERYTHING, SINGLE


def test_the_card_says_how_to_make_it_again(tmp_path):
    from huggingface_hub import DatasetCard

    generate(EVERYTHING, tmp_path, workers=1)
    text = (tmp_path / "README.md").read_text()
    assert text == card(EVERYTHING, "webdataset")
    assert DatasetCard(text).data.size_categories == ["n<1K"]
    assert "| `others_joints` | (2, 6, 15, 3) | sc:Float |" in text
    assert "motionenv dataset make dataset.json --format webdataset --out FOLDER" in text
    assert json.loads(text.split("```json")[1].split("```")[0]) == json.loads(EVERYTHING.json())
    assert "single pictures" in card(SINGLE.replace(frames=5_000_000), "coco")
    assert "1M<n<10M" in card(SINGLE.replace(frames=5_000_000), "coco")
