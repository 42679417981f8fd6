"""Making data sets: tasks over executors, and the manifest that says what is done."""

from motionenv.data.making.generation import Made, generate, verify
from motionenv.data.making.ray_tasks import ray_executor

__all__ = ["Made", "generate", "ray_executor", "verify"]
