"""The file of a campaign: what is run, what is varied, what goes wrong, and what a good run is.

    [campaign]
    project = "fbvm.toml"                   # or sources = ["pump.st"]
    runs = 10000                            # without it one of each combination of the values
    for = "60s"
    never = ["client.Main.Open AND client.Main.Closed"]

    [[vary]]
    name = "client.Main.Wait"
    values = ["T#100ms", "T#1s"]

    [[fault]]
    kind = ["silent", "reset", "slow"]
    between = ["1s", "50s"]
    lasts = ["10ms", "5s"]

    [[power]]
    plc = ["client"]
    between = ["1s", "50s"]
    lasts = "2s"
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.base.dialects import DIALECTS
from fbvm.base.files import SETTINGS_BYTES
from fbvm.base.toml import TomlError, load_toml
from fbvm.campaign.axes import axis_of
from fbvm.campaign.plan import EXACT, MOST_RUNS, REAL, SETTINGS, Axis, FaultRule, Golden, Judging, Moments, PowerRule, Response
from fbvm.net.faults import NAMED, NO_FAULT
from fbvm.run.fault_rows import FAULT, FIELDS
from fbvm.run.project_reader import (
    Key,
    Keys,
    Kind,
    Reading,
    anything,
    endpoint,
    first_and_last,
    moment_ns,
    one_of,
    one_or_more,
    text,
    texts,
    time_ns,
    whole,
)
from fbvm.syntax.text import read

FILE = "campaign.toml"
MOST_TIMES = 1000
"""How often a rule may happen in one run."""
LASTS_NS = (10_000_000, 2_000_000_000)
"""How long faults and power cuts last if nobody says it."""

MOMENT: Keys = {
    "count": Key(whole(1, MOST_TIMES), "How often it may happen in one run.", 1),
    "chance": Key(whole(1, 100), "With how many percent it happens each time.", 100),
    "between": Key(first_and_last(moment_ns), "When it begins: a time after power-on, or the first and the last."),
    "lasts": Key(first_and_last(time_ns), "How long it lasts: a time, or the shortest and the longest.", LASTS_NS),
}
TIMES_OF_PROJECT = ("from", "until", "from_scan", "until_scan")
"""Keys of a fault of a project, in whose place a campaign draws."""
CHOSEN: Keys = {name: Key(one_or_more(key.kind), f"{key.meaning}  One is drawn.", None)
                for name, key in FAULT.items() if name not in TIMES_OF_PROJECT and isinstance(key.kind, Kind)}  # fmt: skip
CAMPAIGN: Keys = {
    "project": Key(text, "The project, from the folder of this file; \"fbvm.toml\" if neither it nor sources are there.", None),
    "sources": Key(texts, "In place of a project: the source files of one PLC.", None),
    "tests": Key(texts, "In place of a project: tests, as pytest names them, from the folder of this file.", ()),
    "program": Key(text, "With sources: the PROGRAM to run.", None),
    "dialect": Key(one_of(tuple(DIALECTS)), "With sources: the dialect.", None),
    "libraries": Key(texts, "With sources: folders of blocks.", ()),
    "cycle": Key(time_ns, "With sources: the cycle time.", 10_000_000),
    "servers": Key(one_or_more(endpoint), "With sources: endpoints of Modbus servers in memory.", ()),
    "runs": Key(whole(1, MOST_RUNS), "How many runs are drawn; without it there is one of each combination of the values.", 0),
    "seed": Key(whole(0, 1 << 62), "What runs are drawn by.", 0),
    "timing": Key(one_of((REAL, EXACT)), "How units answer: late and out of step by the seed of the run, or always alike.", REAL),
    "for": Key(time_ns, "How long a run takes at most.", None),
    "until": Key(text, "What ends a run, and has to hold before `for`.", None),
    "never": Key(texts, "What holds behind no scan.", ()),
    "always": Key(texts, "What holds behind every scan.", ()),
    "show": Key(texts, "Places whose last values are in the results.", ()),
}
RESPONSE: Keys = {
    "trigger": Key(text, "When this becomes true,"),
    "answer": Key(text, "this holds"),
    "within": Key(moment_ns, "after this time at most."),
}
GOLDEN: Keys = {
    "file": Key(text, "The golden file, from the folder of this file."),
    "plc": Key(text, "The PLC, where there are several.", ""),
    "names": Key(texts, "The variables."),
}
VARY: Keys = {
    "name": Key(text, "A variable or an address that is written.", None),
    "setting": Key(one_of(SETTINGS), "What else is varied: the cycle, how much later a PLC begins, how units answer.", None),
    "plc": Key(text, "With setting: the PLC; all without it.", ""),
    "at": Key(moment_ns, "When it is written.", 0),
    "values": Key(one_or_more(anything), "The values.", None),
    "from": Key(anything, "The first value of a range.", None),
    "to": Key(anything, "Its last value.", None),
    "step": Key(anything, "The step of a range, 1 or \"1ms\" if none is given.", None),
}
FILE_KEYS: Keys = {
    "campaign": Key(CAMPAIGN, "What is run and how often, and what a good run is."),
    "vary": Key(VARY, "A parameter and its values.", (), many=True),
    "fault": Key({**CHOSEN, **MOMENT}, "Faults of the network that are drawn.", (), many=True),
    "power": Key({"plc": Key(one_or_more(text), "The PLCs of which one is drawn; all without it.", ()),
                  "start": Key(one_of(("warm", "cold")), "Whether what is retained is kept.", "warm"), **MOMENT},
                 "Power cuts that are drawn.", (), many=True),
    "within": Key(RESPONSE, "An answer that comes in time.", (), many=True),
    "golden": Key(GOLDEN, "A golden trace.", (), many=True),
}  # fmt: skip


@dataclass(frozen=True)
class Written:
    """What a campaign file says, before its programs are compiled.  `about` are the values of its first table."""

    about: Mapping[str, Any] = field(default_factory=lambda: {name: key.default for name, key in CAMPAIGN.items()})
    axes: tuple[Axis, ...] = ()
    faults: tuple[FaultRule, ...] = ()
    cuts: tuple[PowerRule, ...] = ()
    responses: tuple[Response, ...] = ()
    goldens: tuple[Golden, ...] = ()

    @property
    def judging(self) -> Judging:
        """What a good run is."""
        return Judging(self.about["never"], self.about["always"], self.responses, self.about["until"] or "", self.goldens)


def is_campaign(path: Path) -> bool:
    """True for a TOML file with a table [campaign]."""
    found = read(path, str(path), most_bytes=SETTINGS_BYTES)
    if isinstance(found, Diagnostic):
        return False
    try:
        return "campaign" in load_toml(found.text)
    except TomlError:
        return False


def read_plan_file(path: Path) -> Written | list[Diagnostic]:
    """Reads a campaign file.  Returns what it says, or all that is wrong with it."""
    found = read(path, str(path), most_bytes=SETTINGS_BYTES)
    if isinstance(found, Diagnostic):
        return [found]
    reading = Reading(found, kind="campaign")
    table = reading.table(reading.load(), FILE_KEYS) if not reading.diagnostics else {}
    if errors(reading.diagnostics):
        return sorted(reading.diagnostics, key=Diagnostic.order)
    made = Written(
        table["campaign"],
        tuple(_axes(reading, table["vary"])),
        tuple(_fault_rule(row) for row in table["fault"]),
        tuple(PowerRule(_moments(row), row["plc"], row["start"] == "cold") for row in table["power"]),
        tuple(Response(row["trigger"], row["answer"], row["within"]) for row in table["within"]),
        tuple(Golden(row["file"], row["plc"], row["names"], _golden_text(path.parent / row["file"])) for row in table["golden"]),
    )
    if made.about["sources"] and made.about["project"]:
        reading.report("P0103", ("campaign", "sources"), "a campaign runs sources or a project, not both")
    if made.about["tests"] and (made.about["sources"] or made.about["project"]):
        reading.report("P0103", ("campaign", "tests"), "a campaign executes tests, or runs sources or a project: one of them")
    return sorted(reading.diagnostics, key=Diagnostic.order) if errors(reading.diagnostics) else made


def _golden_text(path: Path) -> str:
    """The text of a golden file; "" if there is none, which differs from every run."""
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def _moments(row: Mapping[str, Any]) -> Moments:
    return Moments(row["between"], row["lasts"], row["count"], row["chance"])


# --- faults -----------------------------------------------------------------------------------------------------------


def _fault_rule(row: Mapping[str, Any]) -> FaultRule:
    choices = {FIELDS.get(name, name): values for name, values in row.items()
               if name in CHOSEN and name != "kind" and values is not None}  # fmt: skip
    names = row["kind"] or ()
    kinds = tuple((name, NAMED[name].fault) for name in names) or ((_kind_of(choices), NO_FAULT),)
    return FaultRule(_moments(row), kinds, choices)


def _kind_of(choices: Iterable[str]) -> str:
    """What a fault without a named kind is called."""
    return " ".join(name.removesuffix("_ns") for name in choices if name != "peer") or "fault"


def any_faults(count: int, for_ns: int) -> FaultRule:
    """So many faults of any kind, at any time of a run that takes `for_ns`.  None of them loses or doubles a part of a
    stream, which TCP itself never does.  Raises ValueError for too many."""
    kinds = tuple((name, kind.fault) for name, kind in NAMED.items()
                  if not kind.fault.lose_percent and not kind.fault.duplicate_percent)  # fmt: skip
    return FaultRule(Moments((0, for_ns), LASTS_NS, _times(count)), kinds)


def any_cuts(count: int, for_ns: int) -> PowerRule:
    """So many power cuts of any of the PLCs, at any time of a run that takes `for_ns`.  Raises ValueError for too many."""
    return PowerRule(Moments((0, for_ns), LASTS_NS, _times(count)), ())


def _times(count: int) -> int:
    if count > MOST_TIMES:
        raise ValueError(f"{count:,} faults or power cuts are too many: a run has {MOST_TIMES:,} of each at most")
    return count


# --- axes -------------------------------------------------------------------------------------------------------------


def _axes(reading: Reading, table: Sequence[Mapping[str, Any]]) -> Iterator[Axis]:
    for number, row in enumerate(table):
        path = ("vary", number)
        if (row["name"] is None) == (row["setting"] is None):
            reading.report("P0104", path, f"vary {number + 1} varies nothing", "write name = or setting =, not both")
            continue
        try:
            yield axis_of(row)
        except ValueError as error:
            reading.report("P0103", path, f"vary {number + 1}: {error}")


def with_about(written: Written, **changes: Any) -> Written:
    """What a file says, with some values of its first table changed."""
    return replace(written, about={**written.about, **changes})
