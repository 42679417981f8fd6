"""Benchmarks of the gait models."""
