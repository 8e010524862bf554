"""Commands that measure and fit: one module each, named like its command."""
