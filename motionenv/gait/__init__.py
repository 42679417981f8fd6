"""Gait analysis: events, steady stretches, step parameters, and reports."""
