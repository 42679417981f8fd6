"""LeRobot's layout of data sets, version 3.0: MP4 films of clips, and the truth of each frame in Parquet.

A clip is an episode. Shard k is `data/chunk-000/file-00k.parquet`, `videos/observation.images.rgb/` with the same path
and its clips one after the other (.mp4), and `meta/episodes/chunk-000/file-00k.parquet`. A pose is `observation.state`;
other truth is `truth.` and the field's name, flattened; what a clip has once is repeated in every frame. Pictures are
lossy H.264, truth is exact. See https://huggingface.co/docs/lerobot/lerobot-dataset-v3.
"""

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import orjson

from motionenv.data.formats.encoding import column
from motionenv.data.samples import Sample
from motionenv.data.specification import PICTURES, Specification
from motionenv.data.store import Store
from motionenv.errors import MotionError
from motionenv.render.video.encode import write_video
from motionenv.types import POSE

_VIDEO = "observation.images.rgb"
_TASK = "walk"
_CHUNK = 1000  # files in a folder
_SHARP = 12  # quality of H.264: no loss that people see
_ONCE = ("walker", "offsets", "radii", "height", "K", "R")
_NUMBERS = ("timestamp", "frame_index", "episode_index", "index", "task_index")


class LeRobot:
    """A `Format` of films with a table of truth."""

    name: ClassVar[str] = "lerobot"

    def check(self, spec: Specification) -> None:
        """Raise a MotionError unless `spec` is of clips with colours, and no other pictures."""
        if spec.clip == 1:
            raise MotionError("format lerobot is for clips: set clip to more than 1, or use webdataset")
        if "rgb" not in spec.output.fields or "poses" not in spec.output.fields:
            raise MotionError("format lerobot needs rgb and poses among output.fields")
        if others := [name for name in spec.output.fields if name in PICTURES and name != "rgb"]:
            raise MotionError(f"format lerobot has films of rgb only: leave {', '.join(others)} out of output.fields")

    def write(self, samples: Iterator[Sample], folder: Path, shard: int, spec: Specification) -> None:
        """Write a `shard` of `samples` of `spec` below `folder`; see `Format`. Another thread encodes."""
        place, film = _place(shard), folder / f"videos/{_VIDEO}/{_place(shard)}.mp4"
        film.parent.mkdir(parents=True)
        frames: list[dict[str, np.ndarray]] = []
        episodes: list[dict[str, Any]] = []

        def pictures() -> Iterator[np.ndarray]:
            for k, sample in enumerate(samples):
                rows = _rows(sample, spec)
                frames.append(rows)
                episodes.append(_episode(sample, rows, k, shard, spec))
                yield from sample["rgb"]

        write_video(film, pictures(), spec.fps, crf=_SHARP)
        whole = {name: np.concatenate([rows[name] for rows in frames]) for name in frames[0]}
        _write({name: column(values) for name, values in whole.items()}, folder / f"data/{place}.parquet")
        _write(_columns(episodes), folder / f"meta/episodes/{place}.parquet")

    def finish(self, store: Store, rows: list[dict], spec: Specification) -> None:
        """Write what describes the whole set to a `store`, of which the manifest has `rows`; see `Format`."""
        tables = [_read(store, f"meta/episodes/{_place(row['shard'])}.parquet") for row in rows]
        store.write("meta/stats.json", _json(_whole_stats(tables)))
        store.write("meta/tasks.parquet", _tasks())
        first = _read(store, f"data/{_place(0)}.parquet", rows=1)
        features = {name: _feature(name, np.asarray(values[0])) for name, values in first.items()}
        features[_VIDEO] = _film(spec)
        about = {
            "codebase_version": "v3.0", "robot_type": "person", "total_episodes": spec.samples,
            "total_frames": spec.samples * spec.clip, "total_tasks": 1, "chunks_size": _CHUNK,
            "data_files_size_in_mb": 100, "video_files_size_in_mb": 200, "fps": spec.fps,
            "splits": {"train": f"0:{spec.samples}"},
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
            "features": features,
        }  # fmt: skip
        store.write("meta/info.json", _json(about))


def _film(spec: Specification) -> dict[str, Any]:
    """The description of the films."""
    height, width = spec.pictures.height, spec.pictures.width
    info = {
        "video.height": height, "video.width": width, "video.codec": "h264", "video.pix_fmt": "yuv420p",
        "video.is_depth_map": False, "video.fps": spec.fps, "video.channels": 3, "has_audio": False,
    }  # fmt: skip
    return {"dtype": "video", "shape": [height, width, 3], "names": ["height", "width", "channels"], "info": info}


def _place(shard: int) -> str:
    return f"chunk-{shard // _CHUNK:03d}/file-{shard % _CHUNK:03d}"


def _rows(sample: Sample, spec: Specification) -> dict[str, np.ndarray]:
    """The columns of a clip's frames, arrays (frames, ...) flattened."""
    frames, episode = np.arange(spec.clip), int(sample["index"])
    rows: dict[str, np.ndarray] = {
        "timestamp": (frames / spec.fps).astype(np.float32), "frame_index": frames,
        "episode_index": np.full(spec.clip, episode), "index": episode * spec.clip + frames,
        "task_index": np.zeros(spec.clip, np.int64),
    }  # fmt: skip
    for name, values in sample.items():
        if name not in (*PICTURES, "index"):
            each = np.moveaxis(values, 1, 0) if name.startswith("others_") else values
            each = np.broadcast_to(values, (spec.clip, *values.shape)) if name in _ONCE else each
            flat = each.reshape(spec.clip, -1)
            label = "observation.state" if name == "poses" else f"truth.{name}"
            rows[label] = flat[:, 0] if flat.shape[1] == 1 else flat
    return rows


def _episode(sample: Sample, rows: dict[str, np.ndarray], k: int, shard: int, spec: Specification) -> dict[str, Any]:
    """The row of a clip, the `k`-th of its shard, in the table of episodes."""
    index, chunk, file = int(sample["index"]), shard // _CHUNK, shard % _CHUNK
    episode: dict[str, Any] = {
        "episode_index": index, "tasks": [_TASK], "length": spec.clip,
        "data/chunk_index": chunk, "data/file_index": file,
        "dataset_from_index": index * spec.clip, "dataset_to_index": (index + 1) * spec.clip,
        f"videos/{_VIDEO}/chunk_index": chunk, f"videos/{_VIDEO}/file_index": file,
        f"videos/{_VIDEO}/from_timestamp": k * spec.clip / spec.fps,
        f"videos/{_VIDEO}/to_timestamp": (k + 1) * spec.clip / spec.fps,
        "meta/episodes/chunk_index": chunk, "meta/episodes/file_index": file,
    }  # fmt: skip
    colours = (sample["rgb"].reshape(-1, 3) / 255.0)[:, :, None, None]
    for name, values in {**rows, _VIDEO: colours}.items():
        for kind, value in _stats(values).items():
            episode[f"stats/{name}/{kind}"] = value.tolist()
    return episode


def _stats(values: np.ndarray) -> dict[str, np.ndarray]:
    """Least, greatest, mean, standard deviation and number of values (n, ...), which may be missing."""
    values = values[:, None] if values.ndim == 1 else values
    known = np.isfinite(values)
    count = known.sum(axis=0)
    filled = np.where(known, values, 0).astype(np.float64)
    mean = filled.sum(axis=0) / np.maximum(count, 1)
    spread = np.where(known, filled - mean, 0)
    return {
        "min": np.where(count > 0, np.where(known, filled, np.inf).min(axis=0), 0),
        "max": np.where(count > 0, np.where(known, filled, -np.inf).max(axis=0), 0),
        "mean": mean,
        "std": np.sqrt((spread**2).sum(axis=0) / np.maximum(count, 1)),
        "count": np.array([len(values)]),
    }


def _whole_stats(tables: list[dict[str, list]]) -> dict[str, dict[str, Any]]:
    """The statistics of all episodes from those of each (Chan et al. 1979), weighted by their numbers of values."""
    found: dict[str, dict[str, Any]] = {}
    for name in (key.split("/")[1] for key in tables[0] if key.startswith("stats/") and key.endswith("/mean")):
        least, most, mean, spread, count = (
            np.concatenate([np.array(table[f"stats/{name}/{kind}"], float) for table in tables])
            for kind in ("min", "max", "mean", "std", "count")
        )
        share = (count / count.sum()).reshape(-1, *[1] * (mean.ndim - 1))
        middle = (share * mean).sum(axis=0)
        variance = (share * (spread**2 + (mean - middle) ** 2)).sum(axis=0)
        found[name] = {
            "min": least.min(axis=0).tolist(), "max": most.max(axis=0).tolist(), "mean": middle.tolist(),
            "std": np.sqrt(variance).tolist(), "count": [int(count.sum())],
        }  # fmt: skip
    return found


def _feature(name: str, value: np.ndarray) -> dict[str, Any]:
    """The description of a column."""
    names = list(POSE) if name == "observation.state" else None
    return {"dtype": str(value.dtype), "shape": list(value.shape) or [1], "names": names}


def _columns(episodes: list[dict[str, Any]]) -> dict[str, Any]:
    import pyarrow

    return {name: pyarrow.array([episode[name] for episode in episodes]) for name in episodes[0]}


def _write(columns: dict[str, Any], path: Path) -> None:
    import pyarrow
    import pyarrow.parquet as parquet

    path.parent.mkdir(parents=True)
    parquet.write_table(pyarrow.table(columns), path, compression="zstd")


def _read(store: Store, path: str, rows: int | None = None) -> dict[str, Any]:
    """Columns of a table in a `store`; of its first `rows` only, as NumPy arrays."""
    import pyarrow.parquet as parquet

    content = store.read(path)
    if content is None:
        raise MotionError(f"{store.url} lacks {path}: delete its row in the manifest, and make it again")
    table = parquet.read_table(io.BytesIO(content))
    if rows is None:
        return table.to_pydict()
    first = table.slice(0, rows)
    return {name: [np.asarray(first[name][0].as_py(), _type_of(first[name].type))] for name in first.column_names}


def _type_of(kind) -> str:
    """NumPy's name of the numbers in a column or in its lists."""
    while hasattr(kind, "value_type"):
        kind = kind.value_type
    return str(np.dtype(kind.to_pandas_dtype()))


def _tasks() -> bytes:
    """The table of the one task, whose text is the index of pandas."""
    import pyarrow
    import pyarrow.parquet as parquet

    index = "__index_level_0__"
    kinds = (("task_index", "task_index", "int64", "int64"), (None, index, "unicode", "object"))
    keys = ("name", "field_name", "pandas_type", "numpy_type")
    described = [{**dict(zip(keys, kind, strict=True)), "metadata": None} for kind in kinds]
    table = pyarrow.table({"task_index": pyarrow.array([0]), index: pyarrow.array([_TASK])})
    about = {"index_columns": [index], "column_indexes": [], "columns": described}
    file = io.BytesIO()
    parquet.write_table(table.replace_schema_metadata({"pandas": json.dumps(about)}), file)
    return file.getvalue()


def _json(content: dict[str, Any]) -> bytes:
    return orjson.dumps(content, option=orjson.OPT_INDENT_2)
