"""Schemas of requests and responses: each field with its unit, its bounds and an example."""
