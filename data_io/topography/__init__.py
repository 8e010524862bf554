"""Profiles and height maps, from text files and from those of instruments."""
