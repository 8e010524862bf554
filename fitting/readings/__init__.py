"""Readings of a goniometer as a fit sees them: noise, aperture, masks, mixing."""
