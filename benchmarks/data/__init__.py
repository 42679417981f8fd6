"""Data sets: how fast they are made, and whether they are good."""
