"""Finds the folders `grammar/` and `fblib/` that travel with the package, and the folder of caches."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

from fbvm.base.host import cache_home

PACKAGE = Path(__file__).resolve().parent.parent
"""The folder of this package."""


@cache
def data_folder(name: str) -> Path:
    """The folder `grammar`, `fblib` or `examples`: inside the package in a wheel, beside it in a checkout or an editable install.

    Raises FileNotFoundError if the installation is damaged and has neither."""
    for folder in (PACKAGE / "_data" / name, PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"{name}/ is missing from this installation of fbvm")


def cache_folder() -> Path:
    """The user's folder for caches, or that which the environment variable FBVM_CACHE names.

    The folder may be missing and may not be writable."""
    if named := os.environ.get("FBVM_CACHE"):
        return Path(named)
    return cache_home()
