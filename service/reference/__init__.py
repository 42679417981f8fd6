"""What the API is, for people and for programs: `/docs`, OpenAPI and AsyncAPI."""
