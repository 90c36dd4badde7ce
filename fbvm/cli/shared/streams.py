"""The standard streams: closed ones are replaced, and what their encoding lacks is written in ASCII."""

from __future__ import annotations

import codecs
import io
import os
import sys

ERRORS = "fbvm.ascii"
"""The name under which codecs find `_in_ascii`."""
_PLAIN_ASCII = "fbvm-ascii"
"""ASCII under a name of its own: click takes a stream in `ascii` for a mistake and writes UTF-8 into it."""
LAST_STREAM = 2
"""The number of the standard error."""
ASCII = {
    **dict.fromkeys(map(chr, range(0x2500, 0x2580)), "+"), **dict.fromkeys("─━═╌╴╶╸╺", "-"),
    **dict.fromkeys("│┃║╎╵╷╹╻╽╿├┝┠┣┤┥┨┫╞╟╠╡╢╣", "|"), **dict.fromkeys("↑▲", "^"), **dict.fromkeys("↓▼", "v"),
    **dict.fromkeys("→▶►", ">"), **dict.fromkeys("←◀◄", "<"), "…": ".", "·": ".", "●": "*", "µ": "u",
    **dict.fromkeys("“”„«»", '"'), **dict.fromkeys("‘’‚′", "'"), **dict.fromkeys("‐‑‒–—−", "-"), "•": "*", "×": "x", "÷": "/",
    "≤": "<", "≥": ">", "\N{NO-BREAK SPACE}": " ",
}  # fmt: skip
"""Characters of drawings and of comments, and one that stands for each where an encoding lacks it, so that columns stay."""


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    """What stands for characters that cannot be encoded."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(ASCII.get(character, "?") for character in error.object[error.start : error.end]), error.end


def _plain_ascii(name: str) -> codecs.CodecInfo | None:
    if name.replace("_", "-") != _PLAIN_ASCII:
        return None
    known = codecs.lookup("ascii")
    return codecs.CodecInfo(known.encode, known.decode, known.streamreader, known.streamwriter, known.incrementalencoder,
                            known.incrementaldecoder, name=_PLAIN_ASCII)


codecs.register_error(ERRORS, _in_ascii)
codecs.register(_plain_ascii)


def prepare_streams() -> None:
    """Makes the standard streams usable: a closed one reads nothing and writes nowhere, also in the processes that are started,
    and every text can be read and written."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8")  # noqa: SIM115
            setattr(sys, name, nowhere)
            if nowhere.fileno() <= LAST_STREAM:  # the number of the closed one, which a new process inherits as its own
                os.set_inheritable(nowhere.fileno(), True)
    if isinstance(sys.stdin, io.TextIOWrapper):
        sys.stdin.reconfigure(errors="backslashreplace")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            in_ascii = codecs.lookup(stream.encoding).name == "ascii"
            stream.reconfigure(encoding=_PLAIN_ASCII if in_ascii else stream.encoding, errors=ERRORS)


def give_up_output() -> None:
    """Lets what is still in the buffer of the standard output vanish, which would fail again at the end of the process."""
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
    except (OSError, ValueError):  # no file of the host, as in tests
        try:
            sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - to the end of the process
        except OSError:  # too many files are open
            sys.stdout = io.StringIO()
