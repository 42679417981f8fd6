"""Shared by every part: files, compiled random numbers, threads, validation. Nothing here is public."""
