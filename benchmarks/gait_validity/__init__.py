"""Gait of drawn people against published norms: `python -m benchmarks.gait_validity`."""
