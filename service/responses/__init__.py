"""Answers: motions in every format, JSON, caching, and answers made in threads."""
