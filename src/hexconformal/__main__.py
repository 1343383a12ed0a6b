"""``python -m hexconformal``: the command line."""

from .app import main

if __name__ == "__main__":
    raise SystemExit(main())
