"""Walking people with known ground truth: see README.md."""

__version__ = "0.1.0"
