"""The table of formats, which says of each what it is for before the module of any is loaded."""

import pytest

from hexconformal.io import FORMATS, READ_EXTENSIONS, SURFACES_ONLY, WRITE_EXTENSIONS


@pytest.mark.parametrize("extension", sorted(FORMATS))
def test_a_format_can_what_the_table_says(extension):
    assert (extension in READ_EXTENSIONS) != (extension in SURFACES_ONLY)
    assert (FORMATS[extension].write is not None) == (extension in WRITE_EXTENSIONS + SURFACES_ONLY)
    assert extension == extension.lower()
    assert extension.startswith(".")


def test_an_unknown_extension_has_no_format():
    assert ".doc" not in FORMATS
    assert FORMATS.get(".doc") is None
