"""The file with the groups of names that pages watch together: what is read of it, what is written, and its limits."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from rows import each_of

from fbvm.live.groups import HEAD, MOST_GROUPS, MOST_NAME, WatchGroups
from fbvm.live.messages import MOST_NAMES, MessageError


def test_a_group_is_written_as_people_write_toml(tmp_path: Path) -> None:
    file = tmp_path / "watch.toml"
    groups = WatchGroups(file)
    assert groups.rows == {} and not file.exists()
    groups.keep(" pumps ", ["Main.P1", 'a"b\x7f'])
    groups.keep("tanks", ["tank/Main.Level"])
    groups.keep("pumps", ["Main.P2"])
    assert groups.rows == {"tanks": ["tank/Main.Level"], "pumps": ["Main.P2"]}
    assert file.read_text() == HEAD + '\n[[group]]\nname = "tanks"\nnames = ["tank/Main.Level"]\n' \
        '\n[[group]]\nname = "pumps"\nnames = ["Main.P2"]\n'
    groups.keep("x", ['a"b\x7f'])
    assert WatchGroups(file).rows == groups.rows
    groups.keep("tanks", [])
    groups.keep("nobody", [])
    assert list(WatchGroups(file).rows) == ["pumps", "x"]


@each_of("name", ["", "  ", "x" * (MOST_NAME + 1), "a\nb", "\x1b[1m"])
def test_what_is_no_name_of_a_group_is_refused(name: str) -> None:
    groups = WatchGroups(Path(__file__).parent / "nowhere.toml")
    with pytest.raises(MessageError, match="a group has a name of 1 to 60 characters"):
        groups.keep(name, ["Main.N"])


def test_there_are_so_many_groups_and_names_and_no_more(tmp_path: Path) -> None:
    groups = WatchGroups(tmp_path / "watch.toml")
    groups.rows = {f"g{number}": ["a"] for number in range(MOST_GROUPS - 1)}
    groups.keep("x" * MOST_NAME, [f"n{number}" for number in range(MOST_NAMES + 1)])
    assert groups.rows["x" * MOST_NAME] == [f"n{number}" for number in range(MOST_NAMES)]
    with pytest.raises(MessageError, match="there are 100 groups already"):
        groups.keep("one more", ["a"])
    groups.keep("g0", ["b"])
    assert groups.rows["g0"] == ["b"] and len(groups.rows) == MOST_GROUPS


def test_of_a_file_what_is_well_formed_is_read_when_it_changes(tmp_path: Path) -> None:
    file = tmp_path / "watch.toml"
    file.write_text(
        'group = [{name = "a", names = ["x", 5, "y"]}, {name = 3, names = []}, {name = "b"}, 7, {name = "c", names = "z"}]')
    groups = WatchGroups(file)
    assert groups.rows == {"a": ["x", "y"]}
    file.write_text('[[group]]\nname = "d"\nnames = []\n')
    os.utime(file, ns=(1, 1))
    groups.look()
    assert groups.rows == {"d": []}
    groups.rows = {}
    groups.look()
    assert groups.rows == {}, "it is read again only if it has changed"
    for number, text in enumerate(("group = 5", "no [ toml", "group = [" + '{name = "a", names = []},' * 101 + "]"), 2):
        file.write_text(text)
        os.utime(file, ns=(number, number))
        groups.look()
    assert groups.rows == {"a": []}
    file.unlink()
    groups.look()
    assert groups.rows == {}
    with pytest.raises(MessageError, match="nowhere cannot be written: "):
        WatchGroups(tmp_path / "no" / "nowhere").keep("a", ["b"])
