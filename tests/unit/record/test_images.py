"""Memory images: what is saved comes back, and what is no image changes nothing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fbvm.base.areas import AREAS
from fbvm.base.memory import Memory
from fbvm.code.compiler import compile_text
from fbvm.record.trace import memory_images

ALL = {"CIO": 6144, "W": 512, "H": 512, "D": 32768}


def memory() -> Memory:
    image = compile_text("PROGRAM Main END_PROGRAM").image
    assert image is not None and AREAS
    return Memory(image.layout.size, image.layout.areas)


@pytest.mark.slow
def test_there_and_back(tmp_path: Path) -> None:
    path, one, other = tmp_path / "image.json", memory(), memory()
    places = [("H", 8), ("CIO", 0), ("CIO", 1499), ("CIO", 6143), ("W", 511), ("H", 7), ("D", 0), ("D", 32767)]
    for number, (area, word) in enumerate(places):
        one.words(area)[word] = 0xFFFF - number
    memory_images.save(one, path, ALL)
    memory_images.load(other, path)
    assert [other.words(area)[word] for area, word in places] == [0xFFFF - number for number in range(len(places))]
    assert other.words("D")[1:32767].tolist() == 32766 * [0]


def test_the_form_of_the_file(tmp_path: Path) -> None:
    path, one = tmp_path / "image.json", memory()
    one.words("D")[2] = 7
    memory_images.save(one, path, ALL)
    assert json.loads(path.read_text()) == {"spaces": {"CIO": [], "W": [], "H": [], "D": [0, 0, 7]}}
    assert list(tmp_path.iterdir()) == [path]


def test_a_part_of_an_area(tmp_path: Path) -> None:
    path, one = tmp_path / "image.json", memory()
    one.words("CIO")[0:3] = memoryview(b"\1\0\2\0\3\0").cast("H")
    memory_images.save(one, path, {"CIO": 2})
    assert json.loads(path.read_text()) == {"spaces": {"CIO": [1, 2]}}


def test_words_of_units_are_neither_saved_nor_loaded(tmp_path: Path) -> None:
    path, one = tmp_path / "image.json", memory()
    for area, word in (("CIO", 1500), ("CIO", 1899), ("D", 30000), ("D", 31599)):
        one.words(area)[word] = 1
    memory_images.save(one, path, ALL)
    assert json.loads(path.read_text())["spaces"] == {"CIO": [], "W": [], "H": [], "D": []}
    path.write_text(json.dumps({"spaces": {"CIO": 1901 * [5]}}))
    memory_images.load(one, path)
    assert one.words("CIO")[1499:1501].tolist() == [5, 1]
    assert one.words("CIO")[1899:1901].tolist() == [1, 5]


def test_spaces_that_the_file_lacks_stay(tmp_path: Path) -> None:
    path, one = tmp_path / "image.json", memory()
    one.words("D")[0:3] = memoryview(b"\1\0\2\0\3\0").cast("H")
    path.write_text('{"spaces": {"D": [9]}}')
    memory_images.load(one, path)
    assert one.words("D")[0:3].tolist() == [9, 2, 3]


WRONG = {
    "not JSON": ("{", "not JSON"),
    "no spaces": ("{}", 'no "spaces"'),
    "a list": ("[]", 'no "spaces"'),
    "another area": ('{"spaces": {"D": [1], "X": [1]}}', "no area X"),
    "no list": ('{"spaces": {"D": 5}}', "not a list"),
    "too long": ('{"spaces": {"W": [' + "0," * 512 + "0]}}", "at most 512"),
    "too much": ('{"spaces": {"D": [1, 65536]}}', "D 1 is 65536"),
    "negative": ('{"spaces": {"D": [1, -1]}}', "D 1 is -1"),
    "a text": ('{"spaces": {"D": [1, "2"]}}', "D 1 is '2'"),
    "a truth": ('{"spaces": {"D": [1, true]}}', "D 1 is True"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_image(name: str, tmp_path: Path) -> None:
    text, said = WRONG[name]
    path, one = tmp_path / "image.json", memory()
    path.write_text(text)
    with pytest.raises(memory_images.ImageError, match=said):
        memory_images.load(one, path)
    assert one.words("D")[0] == 0, "nothing has been written"


def test_the_largest_image_and_words_of_units_that_are_not_set(tmp_path: Path) -> None:
    path, one = tmp_path / "image.json", memory()
    path.write_text(json.dumps({"spaces": {"W": 512 * [65535], "CIO": 1499 * [0] + [3, 4, 0, 5]}}))
    assert memory_images.load(one, path) == {"CIO": [1500, 1502]}
    assert one.words("W").tolist() == 512 * [65535] and one.words("CIO")[1499] == 3
