"""Triangle meshes: read, checked, ready-made and written."""

from pbrdf.surface.mesh.surface import MeshSurface

__all__ = ["MeshSurface"]
