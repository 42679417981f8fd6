"""Lifting of people who move freely: training of its network, and its benchmark."""
