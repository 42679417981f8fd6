"""Benchmarks of the service and its page."""
