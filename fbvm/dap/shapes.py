"""The shapes of arguments that all requests share, so that a client that sends something else is told so."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fbvm.dap.session import Refusal

_OBJECTS = ("source", "format")
_LISTS = ("breakpoints", "filters", "filterOptions")
_OF_OBJECTS = ("breakpoints", "filterOptions")


def check_shapes(arguments: Mapping[str, Any]) -> None:
    """Raises Refusal for an argument that is no object or list where the protocol has one.  None is as if it were missing."""
    for name in _OBJECTS:
        if not isinstance(arguments.get(name) or {}, dict):
            raise Refusal(f"the argument {name} has to be an object")
    for name in _LISTS:
        if not isinstance(arguments.get(name) or [], list):
            raise Refusal(f"the argument {name} has to be a list")
    for name in _OF_OBJECTS:
        if not all(isinstance(each, dict) for each in arguments.get(name) or ()):
            raise Refusal(f"the argument {name} has to be a list of objects")
