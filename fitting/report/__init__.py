"""The report of a pipeline: page, figures and files."""
