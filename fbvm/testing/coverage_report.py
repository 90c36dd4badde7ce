"""Coverage for people and for other programs: a table, HTML pages, Cobertura XML."""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from fbvm.base.diagnostics import Source
from fbvm.base.files import write_file
from fbvm.syntax.text import read
from fbvm.testing.coverage import Coverage, FileCoverage


def percent(rate: float) -> str:
    """100% is said of all only, 0% of nothing only."""
    whole = round(rate * 100)
    return f"{min(99, max(1, whole)) if 0 < rate < 1 else whole}%"


def _shown(path: str, root: Path) -> str:
    return Path(path).relative_to(root).as_posix() if Path(path).is_relative_to(root) else path


def _missed(coverage: FileCoverage) -> str:
    """`7-9, 12, 14->16, 14->past`"""
    runs: list[list[int]] = []
    number = {line: at for at, line in enumerate(sorted(coverage.lines))}
    for line in coverage.missing:
        if runs and number[line] == number[runs[-1][1]] + 1:
            runs[-1][1] = line
        else:
            runs.append([line, line])
    said = [(first, str(first) if first == last else f"{first}-{last}") for first, last in runs]
    said += [(line, f"{line}->{to or 'past'}") for line, branches in coverage.partial.items() for to in branches]
    return ", ".join(text for _, text in sorted(said, key=lambda row: row[0]))


def table(coverage: Coverage, root: Path) -> Iterator[str]:
    """Lines of text, one a file, and the total."""
    rows = [(_shown(path, root), *_counts(each), percent(each.rate()), _missed(each))
            for path, each in sorted(coverage.files.items())]  # fmt: skip
    total = _total(coverage)
    rows.append(("TOTAL", *_counts(total), percent(total.rate()), ""))
    left = max(len(row[0]) for row in rows)
    yield f"{'Name':<{left}}  Stmts  Miss  Branch  Miss  Cover  Missing"
    for name, statements, missed, branches, untaken, cover, missing in rows:
        yield f"{name:<{left}}  {statements:>5}  {missed:>4}  {branches:>6}  {untaken:>4}  {cover:>5}  {missing}".rstrip()


def _counts(coverage: FileCoverage) -> tuple[int, int, int, int]:
    branches = [count for each in coverage.branches.values() for count in each.values()]
    return (len(coverage.statements), sum(not count for count in coverage.statements.values()), len(branches),
            sum(not count for count in branches))  # fmt: skip


_LINES_OF_A_FILE = 1_000_000


def _total(coverage: Coverage) -> FileCoverage:
    total = FileCoverage()
    for number, each in enumerate(coverage.files.values()):
        shift = number * _LINES_OF_A_FILE  # so that lines of two files are not one
        total.statements |= {(line + shift, column): count for (line, column), count in each.statements.items()}
        total.branches |= {(line + shift, column): branches for (line, column), branches in each.branches.items()}
    return total


# --- Cobertura --------------------------------------------------------------------------------------------------------


def cobertura(coverage: Coverage, root: Path) -> str:
    """The XML that GitLab, Jenkins and others read (Cobertura's DTD, version 04)."""
    total = _total(coverage)
    top = ElementTree.Element("coverage", _rates(total) | {
        "lines-covered": str(sum(count > 0 for count in total.lines.values())), "lines-valid": str(len(total.lines)),
        "branches-covered": str(_counts(total)[2] - _counts(total)[3]), "branches-valid": str(_counts(total)[2]),
        "complexity": "0", "version": "fbvm", "timestamp": "0"})  # fmt: skip
    ElementTree.SubElement(ElementTree.SubElement(top, "sources"), "source").text = str(root)
    package = ElementTree.SubElement(ElementTree.SubElement(top, "packages"), "package",
                                     {"name": ".", "complexity": "0"} | _rates(total))  # fmt: skip
    classes = ElementTree.SubElement(package, "classes")
    for path, each in sorted(coverage.files.items()):
        name = _shown(path, root)
        row = ElementTree.SubElement(classes, "class", {"name": Path(path).stem, "filename": name, "complexity": "0"}
                                     | _rates(each))  # fmt: skip
        ElementTree.SubElement(row, "methods")
        lines = ElementTree.SubElement(row, "lines")
        taken: dict[int, list[int]] = {}
        for (line, _), branches in each.branches.items():
            taken.setdefault(line, []).extend(branches.values())
        for line, count in sorted(each.lines.items()):
            _line(lines, line, count, taken.get(line, []))
    ElementTree.indent(top)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(top, encoding="unicode") + "\n"


def _rates(coverage: FileCoverage) -> dict[str, str]:
    lines, (_, _, branches, missed) = coverage.lines, _counts(coverage)
    line_rate = sum(count > 0 for count in lines.values()) / len(lines) if lines else 1.0
    return {"line-rate": f"{line_rate:.4f}", "branch-rate": f"{(branches - missed) / branches if branches else 1.0:.4f}"}


def _line(parent: ElementTree.Element, line: int, count: int, branches: list[int]) -> None:
    """A line that was executed so often, and how often each way was taken from it."""
    row = {"number": str(line), "hits": str(count), "branch": "true" if branches else "false"}
    if branches:
        taken = sum(count > 0 for count in branches)
        row["condition-coverage"] = f"{100 * taken // len(branches)}% ({taken}/{len(branches)})"
    ElementTree.SubElement(parent, "line", row)


# --- HTML -------------------------------------------------------------------------------------------------------------

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>
:root {{ color-scheme: light dark; --run: light-dark(#e3f6e5, #12351a); --miss: light-dark(#ffe0e0, #4a1618);
 --part: light-dark(#fff3c4, #453b0d); --dim: light-dark(#666, #999) }}
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; padding: 0 1rem }}
table {{ border-collapse: collapse }} th, td {{ padding: .15rem .8rem; text-align: right }}
th:first-child, td:first-child {{ text-align: left }}
pre {{ margin: 0; overflow-x: auto }} pre div {{ padding: 0 .5rem; white-space: pre }}
.run {{ background: var(--run) }} .miss {{ background: var(--miss) }} .part {{ background: var(--part) }}
i {{ color: var(--dim); font-style: normal; user-select: none }}
</style></head><body><h1>{title}</h1>
{body}
</body></html>
"""


def write_pages(coverage: Coverage, root: Path, folder: Path) -> Path:
    """One page a file and `index.html`, which it returns."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for number, (path, each) in enumerate(sorted(coverage.files.items())):
        name, page = _shown(path, root), f"{number}_{Path(path).stem}.html"
        write_file(folder / page, _page(f"{name}: {percent(each.rate())}", _source(path, each)))
        statements, missed, branches, untaken = _counts(each)
        rows.append(f'<tr><td><a href="{html.escape(page)}">{html.escape(name)}</a><td>{statements}<td>{missed}'
                    f"<td>{branches}<td>{untaken}<td>{percent(each.rate())}")  # fmt: skip
    head = "<tr><th>File<th>Statements<th>missed<th>Branches<th>missed<th>Coverage"
    total = percent(_total(coverage).rate())
    index = folder / "index.html"
    write_file(index, _page(f"Coverage: {total}", f"<table>{head}{''.join(rows)}</table>"))
    return index


def _page(title: str, body: str) -> str:
    return _PAGE.format(title=html.escape(title), body=body)


def _source(path: str, coverage: FileCoverage) -> str:
    source = read(Path(path), path)
    if not isinstance(source, Source):
        return f"<p>{html.escape(source.message)}</p>"
    lines, partial, out = coverage.lines, coverage.partial, []
    for number in range(1, len(source.line_starts) + 1):
        kind = "" if number not in lines else "miss" if not lines[number] else "part" if number in partial else "run"
        branches = ", ".join("past it" if not to else f"to line {to}" for to in partial.get(number, []))
        note = f' title="never went {branches}"' if kind == "part" else ""
        count = f"{lines[number]:>7}" if number in lines else " " * 7
        out.append(f'<div class="{kind}"{note}><i>{number:>5} {count}</i>  {html.escape(source.line(number))}</div>')
    return f"<p><a href=\"index.html\">all files</a></p><pre>{''.join(out)}</pre>"
