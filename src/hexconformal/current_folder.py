"""No code of the current folder, where meshes of others may lie, is run by ``python -m hexconformal``.

Python puts that folder first among those that it imports from. It is taken out of them here, before anything that is
not Python's own is imported, unless the program itself lies there.
"""

import os
import sys

__all__: list[str] = []

_HOME = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

# The first word is this while Python imports the package that it is told to run.
if sys.argv[:1] == ["-m"] and sys.path[:1] in ([""], [os.getcwd()]) and os.getcwd() != _HOME:
    del sys.path[0]
