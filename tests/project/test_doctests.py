"""Every example in a docstring runs, as installed."""

import doctest
import importlib
import pkgutil

import pytest

import hexconformal
import surface

MODULES = [
    module.name
    for package in (hexconformal, surface)
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
    if not module.name.endswith("__main__")
]


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    failed, _ = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0
