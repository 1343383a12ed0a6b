"""Surface meshes: the container of points, faces and arrays.

Belongs here: the container. The geometry of its faces is in `hexconformal.geometry`. Imports `hexconformal.common`,
`hexconformal.geometry`, `hexconformal.mesh` and `hexconformal.io`.
"""

from .surface_mesh import ArraysOrigin, Floats, Ints, SurfaceMesh

__all__ = ["ArraysOrigin", "Floats", "Ints", "SurfaceMesh"]
