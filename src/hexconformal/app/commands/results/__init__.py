"""The files that come of a command: checked before it begins, written when it ends."""
