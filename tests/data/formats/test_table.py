import numpy as np
import pyarrow.parquet as parquet

from motionenv.data.formats.table import Table


def test_rows_come_back_and_pictures_stay_out(tmp_path):
    table, rng = Table(), np.random.default_rng(1)
    samples = [
        {"rgb": np.zeros((2, 2, 3)), "joints": rng.normal(size=(3, 4, 2)), "index": np.array(k)} for k in range(5)
    ]
    samples[2]["joints"][0] = np.nan
    for sample in samples:
        table.add(sample, {"key": str(sample["index"])})
    for name in ("one", "two"):
        table.write(tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    read = parquet.read_table(tmp_path / "one")
    assert read.column_names == ["key", "joints", "index"]
    assert read["key"].to_pylist() == list("01234")
    np.testing.assert_array_equal(np.array(read["joints"].to_pylist()), [sample["joints"] for sample in samples])
