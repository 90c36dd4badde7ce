"""Memory images: the words of areas of a PLC as JSON, `{"spaces": {"CIO": [words from address 0 on], "D": [...]}}`.

The words of CPU bus units are left out in both directions: they are the state of a unit, no data of the user.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from fbvm.base.files import IMAGE_BYTES, read_file, write_file
from fbvm.base.memory import Memory
from fbvm.base.printable import one_line

OF_UNITS = {"CIO": range(1500, 1900), "D": range(30000, 31600)}  # 25 and 100 words a unit, W421 6-6-2 p111


class ImageError(ValueError):
    """A file is no memory image; the message says why."""


def save(memory: Memory, path: Path, counts: Mapping[str, int]) -> None:
    """Writes the first words of some areas into a file; `counts` is the number of words by area.

    Words of 0 at the end are left out.  The file is replaced at once or not at all, as `write_file` does.  Raises OSError."""
    spaces = {}
    for name, count in counts.items():
        words = memory.words(name)[:count].tolist()
        of_units = OF_UNITS.get(name, range(0))
        words = [0 if number in of_units else word for number, word in enumerate(words)]
        while words and not words[-1]:
            words.pop()
        spaces[name] = words
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(words)}" for name, words in spaces.items())
    write_file(path, f'{{"spaces": {{\n{lines}\n}}}}\n')


def load(memory: Memory, path: Path) -> dict[str, list[int]]:
    """Loads an image into a memory, wholly or not at all; words that the image does not have keep their values.

    Returns the numbers of the words by area that have a value in the image and are not set, since they belong to units.
    Raises OSError, and ImageError for a file that is no image or has words that this memory lacks."""
    try:
        found = json.loads(read_file(path, IMAGE_BYTES).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise ImageError(f"{one_line(str(path))} is not JSON: {error}") from None
    spaces = found.get("spaces") if isinstance(found, dict) else None
    if not isinstance(spaces, dict):
        raise ImageError(f'{one_line(str(path))} has no "spaces"')
    left: dict[str, list[int]] = {}
    for name, number, word in list(_words(memory, path, spaces)):
        if number not in OF_UNITS.get(name, ()):
            memory.words(name)[number] = word
        elif word:
            left.setdefault(name, []).append(number)
    return left


def _words(memory: Memory, path: Path, spaces: dict[str, object]) -> Iterator[tuple[str, int, int]]:
    for name, words in spaces.items():
        try:
            view = memory.words(name)
        except KeyError:
            raise ImageError(f"{one_line(str(path))}: this PLC has no area {name}") from None
        if not isinstance(words, list) or len(words) > len(view):
            raise ImageError(f"{one_line(str(path))}: {name} is not a list of at most {len(view)} words")
        for number, word in enumerate(words):
            if not isinstance(word, int) or isinstance(word, bool) or not 0 <= word <= 0xFFFF:
                raise ImageError(f"{one_line(str(path))}: {name} {number} is {word!r}, no word from 0 to 65535")
            yield name, number, word
