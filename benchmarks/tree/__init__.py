"""Benchmarks of the motion tree of paper C."""
