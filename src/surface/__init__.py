"""Surface meshes: quaternionic remeshing and curvature flows."""
