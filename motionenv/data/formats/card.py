"""The card of a data set, `README.md`, with the header of Hugging Face's hub."""

from importlib.resources import files

import numpy as np

from motionenv.data.samples import Sampler
from motionenv.data.specification import Specification

_KINDS = {"i": "sc:Integer", "u": "sc:Integer", "b": "sc:Boolean", "f": "sc:Float", "U": "sc:Text"}
_SIZES = ("n<1K", "1K<n<10K", "10K<n<100K", "100K<n<1M", "1M<n<10M", "n>10M")  # Hugging Face's words


def card(spec: Specification, form: str) -> str:
    """The data card of `spec` in the format `form`, in Markdown."""
    from motionenv import __version__

    frames = spec.samples * spec.clip
    fields = [f"| `{name}` | {shape or 'one'} | {kind} |" for name, (kind, shape) in _fields(spec).items()]
    texts, many = files(__package__), _SIZES[min(max(len(str(spec.samples)) - 3, 0), 5)]
    loading = texts.joinpath(f"loading_{form}.md")
    how = loading.read_text(encoding="utf-8") % {"last": f"{spec.shards - 1:06d}"} if loading.is_file() else ""
    return texts.joinpath("card.md").read_text(encoding="utf-8") % {
        "size": many, "frames": f"{frames:,}", "samples": f"{spec.samples:,}", "form": form,
        "what": "single pictures" if spec.clip == 1 else f"clips of {spec.clip} frames at {spec.fps:g} Hz",
        "version": __version__, "models": ", ".join(spec.people.models), "spec": spec.json(),
        "fields": "\n".join(fields), "loading": how.rstrip(),
    }  # fmt: skip


def _fields(spec: Specification) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Type and shape of each field of a sample of `spec`."""
    sample = Sampler(spec).sample(0)
    return {name: (_KINDS[values.dtype.kind], np.shape(values)) for name, values in sample.items()}
