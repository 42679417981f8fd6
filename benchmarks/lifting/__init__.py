"""Benchmarks of lifting 2D walks to 3D."""
