"""The formats, a module each: how it is read and written, and what it cannot keep."""
