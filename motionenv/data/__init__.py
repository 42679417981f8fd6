"""Data sets of walking people with exact truth: specified in a file, made by many processes, the same to the byte.

Public names are loaded on first use: who only writes files needs nothing that draws.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionenv.data.formats import FORMATS
    from motionenv.data.making import Made, generate, verify
    from motionenv.data.parts import split
    from motionenv.data.samples import Sampler
    from motionenv.data.specification import PRESETS, Specification
    from motionenv.data.store import Store
    from motionenv.data.stream import Walkers

__all__ = [
    "FORMATS", "PRESETS", "Made", "Sampler", "Specification", "Store", "Walkers", "generate", "split", "verify",
]  # fmt: skip
_HOME = {
    "FORMATS": "formats", "Made": "making", "generate": "making", "verify": "making", "split": "parts",
    "Sampler": "samples", "PRESETS": "specification", "Specification": "specification", "Store": "store",
    "Walkers": "stream",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    return value
