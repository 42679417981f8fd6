"""Samples of data sets: who walks, from where they are seen, and what that looks like."""

from motionenv.data.samples.sampler import Sample, Sampler

__all__ = ["Sample", "Sampler"]
