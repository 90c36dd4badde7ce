"""What is debugged: PLCs that run or recordings, with the texts of their sources.

`cli/` makes it of the arguments of `launch` and `attach`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fbvm.record.trace.packets import Packet
from fbvm.step.past_session import PastSession
from fbvm.step.session import Session


class LaunchError(Exception):
    """Nothing can be debugged with these arguments; the message says why, `output` has what the compiler says."""

    def __init__(self, message: str, output: str = "") -> None:
        super().__init__(message)
        self.output = output


@dataclass
class Target:
    """PLCs by name with their sessions; `texts` are their sources by name, `paths` where these lie on the host.

    `until_scan` ends the run there; `notes` are told to the user at the beginning; `failure` is why a test failed."""

    sessions: Mapping[str, Session | PastSession]
    texts: Mapping[str, str]
    paths: Mapping[str, Path] = field(default_factory=dict)
    packets: Callable[[], Sequence[Packet]] = tuple
    until_scan: int | None = None
    stop_on_entry: bool | None = None
    notes: Sequence[str] = ()
    failure: str = ""
    close: Callable[[], None] = lambda: None


Opener = Callable[[str, Mapping[str, Any]], Target]
"""Makes a target of "launch" or "attach" and their arguments.  Raises LaunchError."""


def checked(arguments: Mapping[str, Any], keys: Mapping[str, tuple[type, ...]], what: str) -> dict[str, Any]:
    """The arguments without those of the editor's own.  Raises LaunchError for an unknown key and for a value of a wrong type."""
    found = {}
    for key, value in arguments.items():
        if key.startswith("__") or key in EDITOR_KEYS:
            continue
        if key not in keys:
            raise LaunchError(f"{what} has no {key!r}; it has {', '.join(sorted(keys))}")
        if not isinstance(value, keys[key]) or isinstance(value, bool) and bool not in keys[key]:
            kinds = " or ".join(WORDS[kind] for kind in keys[key])
            raise LaunchError(f"{key} of {what} is {kinds}, not {value!r}")
        found[key] = value
    return found


EDITOR_KEYS = {"type", "request", "name", "preLaunchTask", "postDebugTask", "internalConsoleOptions", "presentation",
               "debugServer", "serverReadyAction", "console", "suppressMultipleSessionWarning"}  # fmt: skip
"""What editors keep in a configuration for themselves."""
WORDS = {str: "a text", list: "a list", dict: "an object", bool: "true or false", int: "a whole number"}
