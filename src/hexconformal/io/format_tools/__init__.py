"""Pieces that several file formats share: what a format is and can hold, and the parsers of meshio and VTK."""
