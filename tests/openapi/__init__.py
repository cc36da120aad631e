"""The OpenAPI document of the service beside that of the last release: what was taken away or made narrower."""
