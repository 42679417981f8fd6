import json

import numpy as np
import pyarrow.parquet as parquet
import pytest

from motionenv.data import Sampler, generate
from motionenv.errors import MotionError
from motionenv.render.video import read_frames
from tests.data.walks import EVERYTHING, digests

FIELDS = [name for name in EVERYTHING.output.fields if name not in ("mask", "limbs", "people", "depth")]
SPEC = EVERYTHING.replace(output={"fields": FIELDS})


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    assert generate(SPEC, folder, format="lerobot", workers=1).complete
    return folder


def test_rows_and_films_show_the_same_frames(made):
    about = json.loads((made / "meta" / "info.json").read_text())
    rows = parquet.read_table(made / "data").sort_by("index").to_pydict()
    episodes = parquet.read_table(made / "meta" / "episodes").sort_by("episode_index").to_pylist()
    assert (about["total_episodes"], about["total_frames"]) == (8, 48) == (len(episodes), len(rows["index"]))
    sampler = Sampler(SPEC)
    for episode in episodes:
        sample = sampler.sample(episode["episode_index"])
        part = slice(episode["dataset_from_index"], episode["dataset_to_index"])
        np.testing.assert_array_equal(rows["observation.state"][part], sample["poses"])
        np.testing.assert_array_equal(rows["truth.joints"][part], sample["joints"].reshape(6, 45))
        np.testing.assert_array_equal(rows["truth.K"][part], np.repeat(sample["K"].reshape(1, 9), 6, 0))
        chunk, file = (episode[f"videos/observation.images.rgb/{k}_index"] for k in ("chunk", "file"))
        path = about["video_path"].format(video_key="observation.images.rgb", chunk_index=chunk, file_index=file)
        film = np.stack(list(read_frames(made / path)))
        first = round(episode["videos/observation.images.rgb/from_timestamp"] * SPEC.fps)
        assert np.abs(film[first : first + 6].astype(int) - sample["rgb"]).mean() < 8  # lossy, and small
    features = about["features"]
    assert all(name in rows for name in features if name != "observation.images.rgb")
    assert features["observation.state"]["shape"] == [25]
    assert features["truth.phase"] == {"dtype": "float64", "shape": [1], "names": None}


def test_statistics_are_those_of_all_frames(made):
    stats = json.loads((made / "meta" / "stats.json").read_text())
    rows = parquet.read_table(made / "data").to_pydict()
    for name in ("observation.state", "truth.phase", "truth.pixels"):
        values = np.array(rows[name], float).reshape(48, -1)
        for kind in ("min", "max", "mean", "std"):
            np.testing.assert_allclose(stats[name][kind], getattr(values, kind)(axis=0), atol=1e-9)
    pictures = np.stack([sample["rgb"] for sample in Sampler(SPEC).samples(0, 8)]).reshape(-1, 3) / 255
    np.testing.assert_allclose(np.ravel(stats["observation.images.rgb"]["mean"]), pictures.mean(axis=0))
    np.testing.assert_allclose(np.ravel(stats["observation.images.rgb"]["std"]), pictures.std(axis=0))
    assert np.shape(stats["observation.images.rgb"]["mean"]) == (3, 1, 1)


def test_the_same_bytes_again(made, tmp_path):
    generate(SPEC, tmp_path, format="lerobot", workers=2)
    assert digests(made) == digests(tmp_path)


@pytest.mark.integration
def test_lerobot_reads_it(made):
    lerobot = pytest.importorskip("lerobot.datasets.lerobot_dataset")
    read = lerobot.LeRobotDataset("motionenv/walkers", root=made)
    assert (len(read), read.num_episodes, read.fps) == (48, 8, SPEC.fps)
    item, sample = read[20], Sampler(SPEC).sample(3)
    np.testing.assert_allclose(item["observation.state"], sample["poses"][2], atol=1e-6)
    assert item["task"] == "walk"
    assert item["observation.images.rgb"].shape == (3, 40, 48)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"clip": 1}, "format lerobot is for clips"),
        ({"output": {"fields": ["poses", "joints"]}}, "needs rgb and poses among output.fields"),
        ({"output": {"fields": ["rgb", "poses", "depth"]}}, "leave depth out of output.fields"),
    ],
)
def test_what_it_can_not_hold(changes, told, tmp_path):
    with pytest.raises(MotionError, match=told):
        generate(SPEC.replace(**changes), tmp_path, format="lerobot")
