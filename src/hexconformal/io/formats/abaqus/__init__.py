"""Abaqus and CalculiX decks (.inp): their mesh is read, and new coordinates are put into the text around it."""

from .format import ABAQUS

__all__ = ["ABAQUS"]
