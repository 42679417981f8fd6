"""Agents that are trained for the named tasks: networks by imitation, and PPO."""
