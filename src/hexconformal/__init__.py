"""Regular hexahedral and surface meshes by minimizing quaternionic conformal distortion."""
