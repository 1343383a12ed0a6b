"""Meshes that tests and benchmarks work on: hexahedra, surfaces, and what libraries and files hold."""
