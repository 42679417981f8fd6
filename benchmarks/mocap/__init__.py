"""Benchmarks of reading laboratories' files: how many become motion, joint angles, gait events."""
