"""A page of the progress of a campaign: one HTML file, which is written anew while it runs and loads itself again.

A file and no server: nothing listens, nobody has to be let in, and it is there when the campaign is over."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from hashlib import sha256
from html import escape

from fbvm.campaign.progress import RUNNING, SHRINKING, FailingGroup, Progress

REFRESH_S = 2
WIDTH, HEIGHT = 600, 90
_STYLE = """
:root { color-scheme: light dark; --good: light-dark(#1b7f4d, #4cc38a); --bad: light-dark(#c92a2a, #ff8787); --line: #8886 }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 60rem; padding: 0 1rem; overflow-wrap: anywhere }
progress { width: 100%; height: 1.2rem } dl { display: flex; flex-wrap: wrap; gap: 0 2.5rem } dt { opacity: .75 }
dd { margin: 0; font-size: 1.35rem; font-variant-numeric: tabular-nums } .bad { color: var(--bad) } .good { color: var(--good) }
table { border-collapse: collapse; width: 100% } th, td { padding: .3rem .7rem .3rem 0; border-bottom: 1px solid var(--line);
  text-align: left; vertical-align: top } td:first-child { font-variant-numeric: tabular-nums } code { font-size: .92em }
svg { width: 100%; height: auto } polyline { fill: none; stroke: currentColor; stroke-width: 1.5 } figure { margin: 1rem 0 }
"""
_STYLE_HASH = b64encode(sha256(_STYLE.encode()).digest()).decode()
_POLICY = f"default-src 'none'; style-src 'sha256-{_STYLE_HASH}'; base-uri 'none'; form-action 'none'"
"""No script, no other style, nothing from elsewhere: names of programs and tests stay text."""
_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{policy}">{refresh}
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{percent} % of {title}</title><style>{style}</style></head><body><h1>{title}</h1>
<p>{state}</p><progress max="{runs}" value="{done}" aria-label="runs that are done"></progress>
<dl>{figures}</dl>
{rates}
<h2>Failures</h2>
{failures}
</body></html>
"""
_FIGURES = "<div><dt>{name}</dt><dd{kind}>{value}</dd></div>"


def progress_page(progress: Progress, title: str, recordings: Mapping[int, str]) -> str:
    """The page; `recordings` are the names of files by the number of the first run of a group."""
    goes_on = progress.state in (RUNNING, SHRINKING)
    left_s = progress.left_s if progress.state == RUNNING else None
    figures = [("done", f"{progress.done:,} of {progress.runs:,}", ""), ("good", f"{progress.done - progress.failing:,}", "good"),
               ("failed", f"{progress.failing:,}", "bad" if progress.failing else ""),
               ("runs a second, now", f"{progress.present_rate:,.1f}", ""), ("on average", f"{progress.rate:,.1f}", ""),
               ("it has run for", _time(progress.elapsed_s), ""),
               *([("and will for", _time(left_s), "")] if left_s is not None else [])]  # fmt: skip
    shown = "".join(_FIGURES.format(name=name, value=value, kind=f' class="{kind}"' if kind else "")
                    for name, value, kind in figures)  # fmt: skip
    return _PAGE.format(
        policy=_POLICY, style=_STYLE, title=escape(title), runs=progress.runs, done=progress.done, figures=shown,
        percent=100 * progress.done // max(progress.runs, 1), rates=_rates(progress), state=escape(progress.state),
        refresh=f'<meta http-equiv="refresh" content="{REFRESH_S}">' if goes_on else "",
        failures=_failures(progress.groups, recordings))  # fmt: skip


def _time(seconds: float) -> str:
    hours, rest = divmod(round(seconds), 3600)
    minutes, rest = divmod(rest, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s" if minutes else f"{rest} s"


def _rates(progress: Progress) -> str:
    """Runs a second over the time, as a line."""
    rates = progress.rates
    most = max((rate for _, rate in rates), default=0)
    if len(rates) < 2 or not most:
        return ""
    end_s = rates[-1][0]
    points = " ".join(f"{WIDTH * at / end_s:.1f},{HEIGHT - HEIGHT * rate / most:.1f}" for at, rate in rates)
    said = f"runs a second over {_time(end_s)}, {most:,.0f} at most"
    return (f'<figure><figcaption>{said}</figcaption><svg viewBox="0 -2 {WIDTH} {HEIGHT + 4}" role="img" aria-label="{said}">'
            f'<polyline points="{points}"/></svg></figure>')  # fmt: skip


def _failures(groups: Sequence[FailingGroup], recordings: Mapping[int, str]) -> str:
    if not groups:
        return '<p class="good">none so far</p>'
    rows = "".join(f"<tr><td>{group.runs:,}<td>{group.first}<td>{escape(str(group.failure))}"
                   f"<td><code>{escape(recordings.get(group.first, ''))}</code>" for group in groups)  # fmt: skip
    return f"<table><thead><tr><th>runs<th>first<th>what failed, and where<th>recording</thead><tbody>{rows}</tbody></table>"
