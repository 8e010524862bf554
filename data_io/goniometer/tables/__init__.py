"""Tables with names of columns: cells, meanings, directions, quantities."""
