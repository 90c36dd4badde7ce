"""The report of a teacher's run: an HTML page with a row for each learner, a column for each lesson,
the first wrong prediction of each learner, and all failures."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from hashlib import sha256
from html import escape
from pathlib import Path
from urllib.parse import quote

from fbvm.testing.course.lessons import OF_THE_LEARNER, Lesson, Result
from fbvm.testing.pages import page_path

_STYLE = """
:root { color-scheme: light dark; background: Canvas; color: CanvasText }
:root { --good: light-dark(#1b7f4d, #4cc38a); --bad: light-dark(#c92a2a, #ff8787);
  --link: light-dark(#1a4fa0, #9ec1ff) }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 90rem; padding: 0 1rem; overflow-wrap: break-word }
table { border-collapse: collapse } th, td { padding: .25rem .7rem; border-bottom: 1px solid #8884; text-align: left }
tbody td { white-space: nowrap } .words td { white-space: normal; overflow-wrap: anywhere; min-width: 6rem; max-width: 30rem }
.good { color: var(--good) } .bad { color: var(--bad) } .none { opacity: .75 }
a { color: var(--link) } td a { color: inherit } .wide { overflow-x: auto }
"""
_STYLE_HASH = b64encode(sha256(_STYLE.encode()).digest()).decode()
_POLICY = f"default-src 'none'; style-src 'sha256-{_STYLE_HASH}'; base-uri 'none'; form-action 'none'"
"""No script, no other style, nothing from elsewhere: what learners have written stays text."""
_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{style}</style></head><body><main><h1>{title}</h1>
<p>A cell is the prediction, right or wrong, and how many checks of the program passed.</p>
<div class="wide" tabindex="0" role="region" aria-label="Who did what"><table><thead><tr><th>{heads}</thead><tbody>
{rows}
</tbody></table></div>
<h2>First wrong predictions</h2>
<p>What each learner first predicted wrongly, as it was before it was corrected.</p>
<div class="wide" tabindex="0" role="region" aria-label="First wrong predictions"><table class="words"><thead>
<tr><th>learner<th>lesson<th>question<th>predicted<th>what happens</thead><tbody>
{wrong}
</tbody></table></div>
{details}
</main></body></html>
"""


def summary(results: Mapping[str, Mapping[str, Result]], lessons: tuple[Lesson, ...]) -> list[str]:
    """Lines of text: each learner's lessons, `ok`, `3/5` or `-`."""
    wide = max([len(name) for name in results] + [4])
    heads = " ".join(f"{lesson.number:>5}" for lesson in lessons)
    return [f"{'':<{wide}} {heads}  done"] + [
        f"{name:<{wide}} {' '.join(f'{_short(begun.get(lesson.slug)):>5}' for lesson in lessons)}  "
        f"{sum(result.is_complete for result in begun.values()):>4}" for name, begun in results.items()]  # fmt: skip


def _short(result: Result | None) -> str:
    if result is None:
        return "-"
    return "ok" if result.is_complete else f"{result.prediction + result.passed}/{1 + result.checks}"


def report(results: Mapping[str, Mapping[str, Result]], lessons: tuple[Lesson, ...], out: Path) -> str:
    """The page, whose links lead to pages of failures in `out`."""
    numbers = [f'<abbr title="{escape(lesson.title)}">{lesson.number}</abbr>' for lesson in lessons]
    heads = "<th>".join(["learner", *numbers, "done"])
    rows = "\n".join(
        f"<tr><th>{escape(name)}{''.join(_cell(name, lesson, begun.get(lesson.slug)) for lesson in lessons)}"
        f"<td>{sum(result.is_complete for result in begun.values())}" for name, begun in results.items())  # fmt: skip
    details = "\n".join(_details(name, lesson, begun[lesson.slug], out) for name, begun in results.items()
                        for lesson in lessons if lesson.slug in begun and begun[lesson.slug].failed)  # fmt: skip
    wrong = "\n".join(_first_wrong(name, begun, lessons) for name, begun in results.items())
    return _PAGE.format(title="Lessons", policy=_POLICY, style=_STYLE, heads=heads, rows=rows, wrong=wrong, details=details)


def _first_wrong(name: str, begun: Mapping[str, Result], lessons: Sequence[Lesson]) -> str:
    """The rows of the first lesson in which a learner predicted something wrongly."""
    lesson = next((one for one in lessons if one.slug in begun and begun[one.slug].first_wrong), None)
    if lesson is None:
        return f'<tr><th>{escape(name)}<td class="none" colspan="4">none'
    return "\n".join(f"<tr><th>{escape(name)}<td>{lesson.number}. {escape(lesson.title)}<td>{escape(one.question)}"
                     f'<td class="bad">{escape(one.given)}<td>{escape(one.right)}'
                     for one in begun[lesson.slug].first_wrong)  # fmt: skip


def _cell(name: str, lesson: Lesson, result: Result | None) -> str:
    if result is None:
        return '<td class="none">-'
    mark = "✓" if result.prediction else "✗"
    text = f"{mark} {result.passed}/{result.checks}"
    shown = f'<a href="#{_anchor(name, lesson)}">{text}</a>' if result.failed else text
    return f'<td class="{"good" if result.is_complete else "bad"}">{shown}'


def _anchor(name: str, lesson: Lesson) -> str:
    return escape(quote(f"{name}-{lesson.number}"))


def _details(name: str, lesson: Lesson, result: Result, out: Path) -> str:
    items = []
    for test, why in result.failed:
        page = page_path(out, f"{name}/{lesson.slug}/test_lesson.py::{test}")
        link = f' <a href="{quote(page.relative_to(out).as_posix())}">every scan</a>' if page.exists() else ""
        said = why.removeprefix("AssertionError: ")
        items.append(f"<li><b>{escape(test)}</b>: {escape(said)}{link}")
    files = " and ".join(f'<a href="{quote(f"{name}/{lesson.slug}/{file}")}">{file}</a>' for file in OF_THE_LEARNER)
    return (f'<h2 id="{_anchor(name, lesson)}">{escape(name)}: {lesson.number}. {escape(lesson.title)}</h2>'
            f"<p>{files}</p><ul>{''.join(items)}</ul>")  # fmt: skip
