"""What has a page of its own: results of runs."""

from __future__ import annotations

import os
from collections.abc import Sequence

from .contents import Frame
from .page import Page

__all__ = ["HasPage"]


class HasPage:
    """Base of results that can be looked at in a browser, or inside a notebook."""

    def page(self, frames: Sequence[Frame] = ()) -> Page:
        """The page of the result.

        Parameters
        ----------
        frames
            The mesh at iterations between the first and the last one, if they are there.
        """
        raise NotImplementedError

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Write the result as one HTML file, to look at in a browser; it needs no network and no server.

        Raises
        ------
        WriteError
            If the file cannot be written, or its name does not end in .html or .htm.
        """
        self.page().write(path)

    def _repr_html_(self) -> str:
        return self.page()._repr_html_()
