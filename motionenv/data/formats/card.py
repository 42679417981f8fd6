"""The card of a data set, `README.md`, with the header of Hugging Face's hub."""

import numpy as np

from motionenv.data.samples import Sampler
from motionenv.data.specification import Specification

_KINDS = {"i": "sc:Integer", "u": "sc:Integer", "b": "sc:Boolean", "f": "sc:Float", "U": "sc:Text"}
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

- Bodies are smooth; a face is a nose, ears and hair; feet have no degrees of freedom of their own. Heavy people walk as
  light ones do. People walk and turn; they don't sit, dance or fall, unless the model does.
- Backgrounds are procedural, unless they are a folder of photographs, and there is no ground below the feet.
- What learns from it should be tested on real pictures of the people it will meet. Models learned from few people: see
  `motionenv models` for who they were, and under which licence.
"""


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
