"""From a surface and a source to tallies: fields, plans, moments, Embree."""
