import pytest

from motionenv.data import Specification, Store
from motionenv.data.making.manifest import begin, done, read_head, read_row, read_rows, row_name, write_row
from motionenv.errors import MotionError

SPEC = Specification(frames=100, output={"shard": 40})


@pytest.fixture
def store(tmp_path) -> Store:
    return Store(tmp_path)


def test_rows_tell_what_is_done(store):
    begin(store, SPEC, "webdataset", "never")
    assert read_head(store) == (SPEC, "webdataset")
    assert done(store, SPEC) == set()
    row = write_row(store, SPEC, 2, [{"path": "x", "bytes": 3, "sha256": "0"}])
    assert (row["start"], row["stop"], row["frames"]) == (80, 100, 20)
    assert done(store, SPEC) == {2}
    assert read_row(store, SPEC, 2) == row
    assert read_row(store, SPEC, 1) is None
    more = SPEC.replace(frames=300)
    begin(store, more, "webdataset", "always")
    assert done(store, more) == set()  # shard 2 was cut short: it must be made again
    others = [write_row(store, SPEC, shard, []) for shard in (1, 0)]
    assert read_rows(store, SPEC) == [*others[::-1], row]
    assert row_name(more, 2) == "000002-80-120.json"


@pytest.mark.parametrize(
    ("changes", "form", "told"),
    [
        ({"people": {"turning": 0.5}}, "webdataset", "another data set: people.turning differ"),
        ({"seed": 4}, "webdataset", "seed differ"),
        ({"people": {"models": ["walk/eigenwalkers"]}}, "webdataset", "models, people.models differ"),
        ({}, "coco", "format differ"),
        ({"frames": 50}, "webdataset", "a data set of 100 frames: give as many or more, got 50"),
    ],
)
def test_another_specification_is_refused(store, changes, form, told):
    begin(store, SPEC, "webdataset", "if-possible")
    begin(store, SPEC, "webdataset", "if-possible")
    with pytest.raises(MotionError, match=told):
        begin(store, SPEC.replace(**changes), form, "if-possible")


def test_when_to_go_on(store):
    with pytest.raises(MotionError, match="no data set in .* to go on with"):
        begin(store, SPEC, "webdataset", "always")
    with pytest.raises(MotionError, match="there is no data set in"):
        read_head(store)
    begin(store, SPEC, "webdataset", "never")
    with pytest.raises(MotionError, match="choose another place"):
        begin(store, SPEC, "webdataset", "never")
    with pytest.raises(MotionError, match="resume must be one of never, always, if-possible, got 'maybe'"):
        begin(store, SPEC, "webdataset", "maybe")
    store.write("dataset.json", b"{")
    with pytest.raises(MotionError, match="dataset.json in .* is damaged"):
        begin(store, SPEC, "webdataset", "always")
