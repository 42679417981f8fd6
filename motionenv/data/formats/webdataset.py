"""WebDataset: tar files of samples, and a Parquet index with the truth.

A shard is `shards/shard-000012.tar`, whose samples are files with the same number, `000000049152`, and different ends:
`rgb.png` (or .webp, .jpg), `mask.png`, `limbs.png`, `people.png`, `depth.npz` and `truth.json`; in clips those of
pictures begin with the frame, `000.rgb.png`. `index/shard-000012.parquet` has a row per sample, with the same truth.
"""

import io
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np
import orjson

from motionenv.data.formats.encoding import SUFFIX, Table, encoded, packed, while_drawing
from motionenv.data.samples import Sample
from motionenv.data.specification import PICTURES, Specification
from motionenv.data.store import Store


class WebDataset:
    """A `Format` of tar files, which `webdataset` and `datasets` stream."""

    name: ClassVar[str] = "webdataset"

    def check(self, spec: Specification) -> None:
        """It holds every `spec`."""

    def write(self, samples: Iterator[Sample], folder: Path, shard: int, spec: Specification) -> None:
        """Write a `shard` of `samples` of `spec` below `folder`; see `Format`. Another thread encodes."""
        tar, index = folder / "shards" / f"shard-{shard:06d}.tar", folder / "index" / f"shard-{shard:06d}.parquet"
        tar.parent.mkdir()
        index.parent.mkdir()
        table = Table()
        with tarfile.open(tar, "w", format=tarfile.USTAR_FORMAT) as archive:
            for sample, made in while_drawing(lambda sample: _files(sample, spec), samples, spec.clip):
                table.add(sample, {"key": key_of(sample), "tar": f"shards/{tar.name}"})
                _add(archive, made)
        table.write(index)

    def finish(self, store: Store, rows: list[dict], spec: Specification) -> None:
        """Nothing describes the whole: shards of `spec` stand alone; `store` and `rows` stay as they are."""


def key_of(sample: Sample) -> str:
    """The name of a `sample` in its tar file."""
    return f"{int(sample['index']):012d}"


def _files(sample: Sample, spec: Specification) -> list[tuple[str, bytes]]:
    """Names and contents of a sample's files."""
    made: list[tuple[str, bytes]] = []
    shown = [name for name in PICTURES if name in sample]
    for name in shown:
        single = spec.clip == 1
        for k, picture in enumerate([sample[name]] if single else sample[name]):
            start = "" if single else f"{k:03d}."
            if name == "depth":
                made.append((f"{start}depth.npz", packed(depth=picture)))
            else:
                how = spec.output.picture if name == "rgb" else "png"
                made.append((f"{start}{name}.{SUFFIX[how]}", encoded(picture, how)))
    truth = {name: np.ascontiguousarray(values) for name, values in sample.items() if name not in shown}
    made.append(("truth.json", orjson.dumps(truth, option=orjson.OPT_SERIALIZE_NUMPY)))
    return [(f"{key_of(sample)}.{end}", content) for end, content in made]


def _add(archive: tarfile.TarFile, made: list[tuple[str, bytes]]) -> None:
    """Append files with a header that tells nothing of machine, user or time."""
    for name, content in made:
        header = tarfile.TarInfo(name)
        header.size, header.mode = len(content), 0o644
        archive.addfile(header, io.BytesIO(content))
