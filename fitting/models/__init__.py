"""Models as a fit sees them: the closed form, and light of all bounces from a trace."""
