"""The results of a campaign in a folder: lines that are added while it runs, from which it is resumed, and a table at its end."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO

from fbvm.base.files import write_file
from fbvm.base.host import taken_alone
from fbvm.base.version import VERSION
from fbvm.campaign.execution import Result
from fbvm.campaign.judge import Failure
from fbvm.campaign.plan import VALUE, Axis, Plan
from fbvm.campaign.runs import Outcome
from fbvm.campaign.variants import draw

LINES, TABLE = "results.jsonl", "results.csv"
FORMAT = 1


class OtherCampaign(Exception):
    """The folder holds results of another campaign; the message says so."""


class InUse(Exception):
    """Another process writes results into the folder; the message says so."""


class Store:
    """The file of results of a folder, which is made if it is missing.  `mark` stands for all that results depend on; `fresh`
    drops what is there.

    Raises InUse while another process has it, OtherCampaign for a file with results of anything else, OSError."""

    def __init__(self, folder: Path, mark: str, fresh: bool = False) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / LINES
        self.known: list[Result] = []
        """The results that are there."""
        head = {"format": FORMAT, "fbvm": VERSION, "campaign": mark}
        path.touch()
        self._file: BinaryIO = open(path, "r+b")  # noqa: SIM115 - close closes it
        if not taken_alone(self._file):
            self._file.close()
            raise InUse("is in use: another campaign writes its results there")
        if fresh:
            self._file.truncate(0)
        self._resume(head)
        if not self._file.tell():
            self._write(head)

    def _resume(self, head: dict[str, Any]) -> None:
        """Reads the whole lines that there are; what a crash has cut off is written over."""
        good, first = 0, _line(head)
        for number, line in enumerate(self._file):
            if not number and not first.startswith(line):
                self._file.close()
                raise OtherCampaign("holds results of another campaign, another program or another version of fbvm")
            if not line.endswith(b"\n"):
                break
            try:
                if number:
                    self.known.append(result_of(json.loads(line)))
            except (ArithmeticError, ValueError, TypeError, KeyError):
                break
            good += len(line)
        self._file.seek(good)
        self._file.truncate()

    def add(self, results: Sequence[Result]) -> None:
        """Keeps results.  They are in the file when this returns.  Raises OSError."""
        for result in results:
            self._write(asdict(result))
        self._file.flush()

    def _write(self, row: dict[str, Any]) -> None:
        self._file.write(_line(row))

    def close(self) -> None:
        """Closes the file.  That the host did not take something has `add` said already."""
        with suppress(OSError):
            self._file.close()


def _line(row: dict[str, Any]) -> bytes:
    return json.dumps(row, allow_nan=False).encode() + b"\n"


def result_of(row: dict[str, Any]) -> Result:
    """The result that a line of the file is.  Raises KeyError, TypeError for anything else."""
    failure = row["failure"]
    return Result(int(row["number"]), row["scans"], row["time_ns"], row["memory"], Failure(**failure) if failure else None,
                  tuple(row["shown"]))  # fmt: skip


# --- as a table -------------------------------------------------------------------------------------------------------


def columns(plan: Plan) -> list[str]:
    """The names of the columns of the table."""
    return ["run", "seed", *(axis.name for axis in plan.axes), "faults", "power", "result", "failed", "plc", "scan", "time_ms",
            "code", "file", "line", "scans", *plan.shown]  # fmt: skip


def rows(outcome: Outcome) -> Iterator[list[Any]]:
    """The rows of the table, in the order of the runs: the same for the same campaign, whoever has executed it."""
    plan = outcome.plan
    for result in outcome.rows:
        variant, failure = draw(plan, result.number), result.failure
        values = [axis.text(variant.value(plan, at)) for at, axis in enumerate(plan.axes)]
        said = [failure.kind, failure.text, failure.plc, failure.scan, _ms(failure.now_ns), failure.code, failure.file,
                failure.line or ""] if failure else ["good", "", "", "", _ms(result.time_ns), "", "", ""]  # fmt: skip
        yield [result.number, variant.seed, *values, "; ".join(map(str, variant.faults)), "; ".join(map(str, variant.cuts)),
               *said, result.scans, *(result.shown or [""] * len(plan.shown))]  # fmt: skip


def _ms(time_ns: int) -> int | float:
    return time_ns // 1_000_000 if time_ns % 1_000_000 == 0 else time_ns / 1e6


def write_table(path: Path, outcome: Outcome) -> None:
    """Writes the table as CSV.  Raises OSError."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns(outcome.plan))
    writer.writerows(rows(outcome))
    write_file(path, text.getvalue())


def write_parquet(path: Path, outcome: Outcome) -> None:
    """Writes the table as Parquet: numbers where a column has no other values, and always the same types for the same campaign.
    Raises ImportError without pyarrow, OSError."""
    import pyarrow  # type: ignore[import-not-found, unused-ignore]
    from pyarrow import parquet  # type: ignore[import-not-found, unused-ignore]

    plan, lines = outcome.plan, list(rows(outcome))
    kinds = {name: (_NUMBERS.get(name, str)) for name in columns(plan)[: -len(plan.shown) or None]}
    kinds |= {axis.name: _kind(axis) for axis in plan.axes}
    types: dict[type | None, Any] = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
    arrays = {}
    for at, name in enumerate(columns(plan)):
        kind = kinds.get(name)
        cells = [None if line[at] == "" else line[at] if kind is None else kind(line[at]) for line in lines]
        arrays[name] = pyarrow.array(cells, types.get(kind))
    parquet.write_table(pyarrow.table(arrays), path)


_NUMBERS: dict[str, type] = {"run": int, "seed": int, "scan": int, "time_ms": float, "line": int, "scans": int}


def _kind(axis: Axis) -> type:
    """The type of a column of values of an axis: a number if all of them are written as numbers."""
    kinds = {type(value) for value in axis.values} if axis.what == VALUE else {str}
    return int if kinds == {int} else float if kinds <= {int, float} else str
