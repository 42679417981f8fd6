"""Making data sets: tasks over executors, and the manifest that says what is done."""

from motionenv.data.making.generation import Made, generate, verify

__all__ = ["Made", "generate", "verify"]
