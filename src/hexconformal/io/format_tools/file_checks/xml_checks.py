"""Elements of XML files, for checks before a reader gets them: no declarations, no entities, UTF-8 only."""

from __future__ import annotations

from collections.abc import Callable
from xml.parsers import expat

from ....common import ReadError

__all__ = ["parse_xml"]

_MOST_NESTED = 100
_ENCODINGS = ("", "utf-8", "us-ascii", "ascii", "iso-8859-1")


def parse_xml(
    data: bytes,
    start: Callable[[str, dict[str, str]], None],
    end: Callable[[str], None] = lambda name: None,
    whole: bool = True,
    characters: Callable[[str], bool] | None = None,
) -> None:
    """Parse XML, and refuse what files of meshes have no use for and readers may be overcome by.

    Parameters
    ----------
    data
        The file, or its beginning.
    start, end
        Called with the name, and the attributes, of elements as they begin and end.
    whole
        False for a beginning.
    characters
        Called with pieces of text; where it returns False it is not called again before the next element begins.

    Raises
    ------
    ReadError
        If it is malformed, in another encoding, nested too deeply, or its document type declares something.
    """
    parser = expat.ParserCreate()
    depth = 0

    def begun(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _MOST_NESTED:
            raise ReadError(f"its elements must be nested at most {_MOST_NESTED} deep")
        parser.CharacterDataHandler = text
        start(name, attributes)

    def ended(name: str) -> None:
        nonlocal depth
        depth -= 1
        end(name)

    def text(piece: str) -> None:
        if characters is None or not characters(piece):
            parser.CharacterDataHandler = None

    def declared(version: str, encoding: str | None, standalone: int) -> None:
        if (encoding or "").lower() not in _ENCODINGS:
            raise ReadError(f"its encoding must be UTF-8, not {encoding}")

    def refused(*declaration: object) -> None:
        raise ReadError("its document type must declare nothing: no entities, elements or attributes")

    if data[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" in data[:4]:
        raise ReadError("its encoding must be UTF-8, not UTF-16 or UTF-32")
    parser.StartElementHandler, parser.EndElementHandler = begun, ended
    parser.XmlDeclHandler = declared
    # A document type that is only named, as in the files of DOLFINx, does no harm: nobody looks it up.
    parser.EntityDeclHandler = parser.AttlistDeclHandler = parser.ElementDeclHandler = refused
    parser.NotationDeclHandler = refused
    try:
        parser.Parse(data, whole)
    except expat.ExpatError as problem:
        raise ReadError(f"the file is malformed or truncated ({problem})") from problem
