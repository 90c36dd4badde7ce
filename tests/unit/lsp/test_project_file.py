"""`fbvm.toml` in an editor, by tables: what can be written at a place, and what a key means."""

from __future__ import annotations

from pathlib import Path

from rows import each_of

from fbvm.base.dialects import DIALECTS
from fbvm.lsp.project_file import completions, diagnostics, is_dialect, keys_at, meaning_at
from fbvm.run.fault_rows import FAULT
from fbvm.run.picture_rows import BIND, MOVE
from fbvm.run.project import PLC, PROJECT, RUN, UNIT
from fbvm.run.project_reader import Keys, Kind

TABLES = ["[run]", "[[server]]", "[[door]]", "[[fault]]", "[[picture]]", "[[picture.bind]]", "[picture.bind.move]", "[plc.NAME]",
          "[[plc.NAME.unit]]", "[[plc.NAME.set]]"]  # fmt: skip


@each_of(("text", "keys"), [
    ("", PROJECT), ("\n\n", PROJECT), ("[run]\n", RUN), ("[ run ]\n", RUN), ("[plc.a]\nx = 1\n", PLC), ("[plc.'a b']\n", PLC),
    ("[[plc.a.unit]]\n", UNIT), ("[plc.a]\n[run]\n", RUN), ("[run]\n[plc.a]\n", PLC), ("\t[[fault]]\n", FAULT),
    ("[[picture.bind]]\n", BIND), ("[[picture.bind.move]]\n", MOVE), ("[plc]\n", {}), ("[nobody]\n", {}),
    ("[plc.a.nobody]\n", {}), ("[plc.a.cycle]\n", {}), ("[run.net]\n", {}), ("[run", PROJECT), ("[run]\nx = [1]\n", RUN),
])  # fmt: skip
def test_the_keys_of_the_table_in_which_a_place_lies(text: str, keys: Keys) -> None:
    assert keys_at(text, len(text)) is keys or keys_at(text, len(text)) == keys == {}
    assert keys_at(text + "\n[[server]]\n", len(text)) == keys, "what comes behind does not count"


def offered(text: str) -> list[str]:
    """What is inserted for each thing that is offered at the end of a text."""
    return [inserted for _, _, inserted in completions(text, len(text))]


def plain(keys: Keys) -> list[str]:
    return [f"{name} = " for name, key in keys.items() if isinstance(key.kind, Kind)]


DIALECT_NAMES = list(DIALECTS)


@each_of(("text", "wanted"), [
    ("", TABLES), ("  ", TABLES), ("[", [each[1:] for each in TABLES]), ("[plc.a]\n  [r", [each[1:] for each in TABLES]),
    ("[run]\n", plain(RUN) + TABLES), ("[run]\nse", plain(RUN)), ("[plc.a]\n \t", plain(PLC) + TABLES), ("[nobody]\nx", []),
    ("[plc.a]\ndialect = ", [f'"{name}"' for name in DIALECT_NAMES]), ('[plc.a]\ndialect = "', DIALECT_NAMES),
    ('[plc.a]\n  dialect="st', DIALECT_NAMES), ('[plc.a]\ndialect = "a" # ', [f'"{name}"' for name in DIALECT_NAMES]),
    ('[plc.a]\ndialect = "a" "', DIALECT_NAMES), ("[run]\nnet = ", ['"loop"', '"tcp"']), ('[run]\nnet = "', ["loop", "tcp"]),
    ("[[fault]]\nsilent = ", ["true", "false"]), ('[[fault]]\nsilent = "', ["true", "false"]),
    ("[[plc.a.unit]]\nfins = ", ["true", "false"]), ("[plc.a]\nunit = ", []), ("[plc.a]\nnobody = ", []), ("[run]\n= ", []),
    ("[plc.a]\nprogram = ", []), ("[plc.a]\ncycle = ", ['"10ms"']), ("[nobody]\nnet = ", []),
])  # fmt: skip
def test_what_can_be_written_at_a_place(text: str, wanted: list[str]) -> None:
    assert offered(text) == wanted
    assert all(meaning for _, meaning, _ in completions(text, len(text)))
    assert offered("[run]\n" * text.startswith("[plc") + text) == wanted


def test_labels_are_what_is_written_without_what_follows() -> None:
    rows = {label: (meaning, text) for label, meaning, text in completions("[run]\n", 6)}
    assert rows["net"] == (f"{RUN['net'].meaning}\n\n\"loop\" or \"tcp\"", "net = ")
    assert rows["[plc.NAME]"] == (PROJECT["plc"].meaning, "[plc.NAME]")
    assert list(completions('[run]\nnet = "', 13)) == [(name, RUN["net"].meaning, name) for name in ("loop", "tcp")]


WATCH_CYCLE = ("**watch_cycle**: The longest time that a scan may take, where time is real.\n\na time from 10ms to 40s\n\n"
               "Without it: 1s")  # fmt: skip


@each_of(("text", "at", "wanted"), [
    ("[plc.a]\nwatch_cycle = 1", 8, WATCH_CYCLE), ("[plc.a]\nwatch_cycle = 1", 23, WATCH_CYCLE),
    ("[plc.a]\nwatch_cycle = 1\n", 23, WATCH_CYCLE), ("[plc.a]\nwatch_cycle = 1\n", 24, ""),
    ("[plc.a]\nwatch_cycle = 1", 7, ""), ("[plc.a]\n\nwatch_cycle = 1", 8, ""), ("[run]\nwatch_cycle = 1", 8, ""), ("", 0, ""),
    ("[run]\nseed=1\nnet = 2", 14, f"**net**: {RUN['net'].meaning}\n\n\"loop\" or \"tcp\"\n\nWithout it: loop"),
    ("[run]\nseed=1\nnet = 2", 7, f"**seed**: {RUN['seed'].meaning}\n\n{RUN['seed'].kind.called}\n\nWithout it: 0"),  # type: ignore[union-attr]
    ("[plc.a]\nunit = 1", 9, "**unit**: A unit on its backplane."),
    ("[plc.a]\nsources = []", 9, f"**sources**: {PLC['sources'].meaning}\n\na list of texts"),
    ("[[fault]]\nuntil = 1", 12, f"**until**: {FAULT['until'].meaning}\n\na time above 0, such as \"10ms\""),
    ("[[fault]]\nfrom = 1", 12, f"**from**: {FAULT['from'].meaning}\n\na time, such as \"2s\" or \"0s\"\n\nWithout it: 0s"),
    ("[[door]]\nbacklog = 1", 12, f"**backlog**: {PROJECT['door'].kind['backlog'].meaning}\n\n"  # type: ignore[index]
                                  "true or false\n\nWithout it: false"),
])  # fmt: skip
def test_what_a_key_means(text: str, at: int, wanted: str) -> None:
    assert meaning_at(text, at) == wanted


def test_names_of_dialects_and_what_is_wrong_with_a_text(tmp_path: Path) -> None:
    assert [is_dialect(name) for name in ("codesys", "pascal", "", None, ["codesys"], 1)] == [True, *[False] * 5]
    path = tmp_path / "fbvm.toml"
    assert [each.code for each in diagnostics(path, None)] == ["S0107"]
    assert diagnostics(path, '[plc.a]\nsources = ["a.st"]\n') == []
    assert [each.code for each in diagnostics(path, "[plc.a]\n")] == ["P0104"]
