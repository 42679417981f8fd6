"""Lifting of people who move freely: a network proposes postures, and all frames are then fitted at once."""

__all__: list[str] = []
