"""Benchmarks of the environments."""
