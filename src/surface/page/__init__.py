"""Pages of surfaces, to look at in a browser.

Belongs here: what a page shows of a surface. Imports `hexconformal.geometry`, `hexconformal.mesh`,
`hexconformal.page`, `mesh`, `io` and `quality`.
"""

from .surface_page import surface_page

__all__ = ["surface_page"]
