"""Formats of instruments and standards, each in a module of its own."""
