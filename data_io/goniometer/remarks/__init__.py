"""What remarks on a scan say, of all rows or of those below, and what is done about it."""
