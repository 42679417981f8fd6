"""Benchmarks of ActiveTracking: an estimator, policies that look, and reinforcement learning."""
