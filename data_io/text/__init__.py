"""Text files as people write them: encodings, separators, numbers and units."""
