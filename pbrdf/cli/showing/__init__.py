"""Commands that show and hand over: one module each, named like its command."""
