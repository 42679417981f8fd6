"""The card of a data set, `README.md`, with the header of Hugging Face's hub."""

from importlib.resources import files

import numpy as np

from motionenv.data.samples import Sampler
from motionenv.data.specification import Specification

_KINDS = {"i": "sc:Integer", "u": "sc:Integer", "b": "sc:Boolean", "f": "sc:Float", "U": "sc:Text"}
_LOADED = ("coco", "webdataset")  # formats of which a file beside this one says how they are loaded


def card(spec: Specification, form: str) -> str:
    """The data card of `spec` in the format `form`, in Markdown."""
    from motionenv import __version__

    frames = spec.samples * spec.clip
    fields = [f"| `{name}` | {shape or 'one'} | {kind} |" for name, (kind, shape) in _fields(spec).items()]
    loading = _text(f"loading_{form}.md") % {"last": f"{spec.shards - 1:06d}"} if form in _LOADED else ""
    return _text("card.md") % {
        "size": _size_category(spec.samples), "frames": f"{frames:,}", "samples": f"{spec.samples:,}", "form": form,
        "what": "single pictures" if spec.clip == 1 else f"clips of {spec.clip} frames at {spec.fps:g} Hz",
        "version": __version__, "models": ", ".join(spec.people.models), "spec": spec.json(),
        "fields": "\n".join(fields), "loading": loading.rstrip(),
    }  # fmt: skip


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


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
