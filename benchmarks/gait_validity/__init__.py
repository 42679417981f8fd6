"""Gait of drawn people against published norms: `motionenv bench gait_validity`."""
