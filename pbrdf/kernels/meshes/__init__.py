"""Rays over triangle meshes: Embree finds facets, float64 says where they are met."""
