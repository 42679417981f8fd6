"""What requests and responses are made of: every field with its unit, its bounds and an example."""
