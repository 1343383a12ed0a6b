"""The commands for surfaces, and what commands for all meshes need to know of them."""
