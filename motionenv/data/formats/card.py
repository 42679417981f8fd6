"""Descriptions of a data set: its card, `README.md`, and Croissant metadata, `croissant.json`.

The card has the header of Hugging Face's hub. Croissant (MLCommons, version 1.0) names every file with its SHA-256, and
the columns of the Parquet index.
"""

import json
from importlib.resources import files
from typing import Any

import numpy as np

from motionenv.data.samples import Sampler
from motionenv.data.specification import PICTURES, Specification
from motionenv.data.store import Store

_FILES_MOST = 10_000  # that are named one by one; a longer list is in the manifest alone
_KINDS = {"i": "sc:Integer", "u": "sc:Integer", "b": "sc:Boolean", "f": "sc:Float", "U": "sc:Text"}
_ENCODINGS = {
    "tar": "application/x-tar", "parquet": "application/x-parquet", "json": "application/json", "png": "image/png",
    "jpg": "image/jpeg", "webp": "image/webp", "mp4": "video/mp4",
}  # fmt: skip
_LOADING = {
    "webdataset": """```python
import datasets, webdataset

samples = webdataset.WebDataset("shards/shard-{000000..%(last)s}.tar").decode("rgb")
truth = datasets.load_dataset("parquet", data_files="index/*.parquet")
```""",
    "coco": """```python
from pycocotools.coco import COCO

people = COCO("annotations/person_keypoints.json")
```""",
}
_CARD = """---
pretty_name: Walking people drawn by motionenv
task_categories: [keypoint-detection, image-segmentation, depth-estimation]
tags: [synthetic, human-pose, gait, motionenv]
size_categories: [%(size)s]
---

# Walking people with exact truth

%(frames)s frames in %(samples)s samples (%(what)s), drawn by motionenv %(version)s. Nobody in them is real: %(models)s
made the motion, and bodies are tapered cylinders.

Make it again, to the byte, with the versions in `manifest/`:

```bash
motionenv dataset make dataset.json --format %(form)s --out FOLDER
```

%(loading)s

## Fields

| field | shape | type |
|-|-|-|
%(fields)s

Metres, radians and pixels; the world is x forward, y left, z up; missing values are NaN (null in JSON).
`motionenv.data.samples` describes each field. `walker` numbers people: split training from testing by it.

## How it was made

```json
%(spec)s
```

## Limits

- Bodies have no clothes, hair or faces, and feet have no degrees of freedom of their own. People walk and turn; they
  don't sit, dance or fall, unless the model does.
- Backgrounds are procedural, and there is no ground below the feet.
- What learns from it should be tested on real pictures of the people it will meet. Models learned from few people: see
  `motionenv models` for who they were, and under which licence.
"""


def describe(store: Store, rows: list[dict], spec: Specification, form: str) -> None:
    """Write the card and the metadata of a whole data set.

    Args:
        store: where the data set is.
        rows: of its manifest.
        spec: its specification.
        form: name of its format.

    Raises:
        OSError: they can't be written.
    """
    store.write("README.md", card(spec, form).encode())
    store.write("croissant.json", (json.dumps(croissant(rows, spec, form), indent=1) + "\n").encode())


def card(spec: Specification, form: str) -> str:
    """The data card of `spec` in the format `form`, in Markdown."""
    from motionenv import __version__

    frames = spec.samples * spec.clip
    fields = [f"| `{name}` | {shape or 'one'} | {kind} |" for name, (kind, shape) in _fields(spec).items()]
    return _CARD % {
        "size": _size_category(spec.samples), "frames": f"{frames:,}", "samples": f"{spec.samples:,}", "form": form,
        "what": "single pictures" if spec.clip == 1 else f"clips of {spec.clip} frames at {spec.fps:g} Hz",
        "version": __version__, "models": ", ".join(spec.people.models), "spec": spec.json(),
        "fields": "\n".join(fields), "loading": _LOADING.get(form, "") % {"last": f"{spec.shards - 1:06d}"},
    }  # fmt: skip


def croissant(rows: list[dict], spec: Specification, form: str) -> dict[str, Any]:
    """Croissant metadata of the files in `rows` of the manifest, of `spec` in the format `form`."""
    from motionenv import __version__

    named = [file for row in rows for file in row["files"]]
    objects = [_file(file) for file in named[:_FILES_MOST]]
    tables = [file["path"] for file in named[:_FILES_MOST] if file["path"].endswith(".parquet")]
    return {
        "@context": json.loads(files(__package__).joinpath("croissant_context.json").read_text("utf-8")),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": f"walkers-{spec.hash[:12]}",
        "description": f"{spec.samples * spec.clip:,} frames of walking people with exact truth, format {form}.",
        "version": f"{__version__}+{spec.seed}",
        "distribution": objects,
        "recordSet": [_records(table, spec) for table in tables],
    }


def _file(file: dict[str, Any]) -> dict[str, Any]:
    kind = _ENCODINGS.get(file["path"].rsplit(".", 1)[-1], "application/octet-stream")
    return {
        "@type": "cr:FileObject", "@id": file["path"], "name": file["path"], "contentUrl": file["path"],
        "contentSize": f"{file['bytes']} B", "encodingFormat": kind, "sha256": file["sha256"],
    }  # fmt: skip


def _records(table: str, spec: Specification) -> dict[str, Any]:
    """The record set of one Parquet file."""
    fields = []
    for name, (kind, shape) in _fields(spec).items():
        if name not in PICTURES:
            source = {"fileObject": {"@id": table}, "extract": {"column": name}}
            listed = {"cr:isArray": True, "cr:arrayShape": ",".join(map(str, shape))} if shape else {}
            about = {"@type": "cr:Field", "@id": f"{table}/{name}", "name": name}
            fields.append({**about, "dataType": kind, **listed, "source": source})
    return {"@type": "cr:RecordSet", "@id": f"records/{table}", "name": table, "field": fields}


def _fields(spec: Specification) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Type and shape of each field of a sample of `spec`."""
    sample = Sampler(spec).sample(0)
    return {name: (_KINDS[values.dtype.kind], np.shape(values)) for name, values in sample.items()}


def _size_category(samples: int) -> str:
    """Hugging Face's word for a number of samples."""
    for power, (low, high) in enumerate((("1K", "10K"), ("10K", "100K"), ("100K", "1M"), ("1M", "10M")), 3):
        if samples < 10 ** (power + 1):
            return "n<1K" if samples < 1000 else f"{low}<n<{high}"
    return "n>10M"
