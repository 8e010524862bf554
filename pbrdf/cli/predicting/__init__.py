"""Commands that predict: one module each, named like its command."""
