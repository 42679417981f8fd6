import io
import json

import numpy as np
import pytest
from PIL import Image

from motionenv.data import Sampler, generate
from motionenv.data.specification import PICTURES
from tests.data.walks import EVERYTHING, SINGLE, same


@pytest.fixture(scope="module", params=["clips", "single"])
def made(request, tmp_path_factory):
    spec = EVERYTHING if request.param == "clips" else SINGLE.replace(output={"picture": "webp"})
    folder = tmp_path_factory.mktemp("set")
    generate(spec, folder, workers=1)
    return spec, folder


def decoded(name: str, content: bytes) -> np.ndarray:
    return (
        np.load(io.BytesIO(content))["depth"] if name.endswith("npz") else np.asarray(Image.open(io.BytesIO(content)))
    )


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")  # its own
def test_webdataset_reads_exactly_what_was_drawn(made):
    import webdataset

    spec, folder = made
    tars = sorted(str(tar) for tar in folder.glob("shards/*.tar"))
    sampler, count = Sampler(spec), 0
    for stored in webdataset.WebDataset(tars, shardshuffle=False, empty_check=False):
        index = int(stored["__key__"])
        sample = sampler.sample(index)
        truth = json.loads(stored["truth.json"])
        for name, values in sample.items():
            if name in PICTURES:
                files = sorted(end for end in stored if end.split(".")[-2:-1] == [name])
                found = np.stack([decoded(end, stored[end]) for end in files])
                np.testing.assert_array_equal(found if spec.clip > 1 else found[0], values)
            else:
                given = np.array(truth[name], dtype=float)  # null becomes NaN
                np.testing.assert_array_equal(given, values)
        count += 1
    assert count == spec.samples


def test_the_index_opens_everywhere(made):
    import datasets
    import duckdb
    import polars

    spec, folder = made
    files = f"{folder}/index/*.parquet"
    sample = Sampler(spec).sample(spec.samples - 1)
    joints = duckdb.sql(f"select joints from '{files}' order by index desc limit 1").fetchall()[0][0]
    np.testing.assert_array_equal(np.array(joints), sample["joints"])
    frame = polars.scan_parquet(files).sort("index").collect()
    assert frame["index"].to_list() == list(range(spec.samples))
    np.testing.assert_array_equal(np.array(frame["K"].to_list()[-1]), sample["K"])
    loaded = datasets.load_dataset("parquet", data_files=files, split="train", cache_dir=str(folder.parent / "cache"))
    row = next(row for row in loaded if row["index"] == spec.samples - 1)
    assert row["key"] == f"{spec.samples - 1:012d}"
    assert same({"poses": np.array(row["poses"])}, {"poses": sample["poses"]})


def test_headers_tell_nothing_of_machine_or_time(made):
    import tarfile

    _, folder = made
    with tarfile.open(folder / "shards" / "shard-000000.tar") as archive:
        for member in archive:
            assert (member.mtime, member.uid, member.gid, member.uname, member.mode) == (0, 0, 0, "", 0o644)
