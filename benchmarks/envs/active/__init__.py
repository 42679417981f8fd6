"""Benchmarks of ActiveTracking: what looking is worth, the best open-loop policy, and reinforcement learning."""

LEVELS = "Easy", "Medium", "Hard"
