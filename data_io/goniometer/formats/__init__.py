"""Formats of others, each module with `looks_like` and `read`."""
