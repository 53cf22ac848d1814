"""A certificate as a page: one file that any browser shows and any printer prints."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from robot_models.incoming import printable

if TYPE_CHECKING:
    from tracking.evaluation import Certificate

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 52rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
h1 { font-size: 1.5rem } h2 { font-size: 1.1rem; margin-top: 2rem }
.big { font-size: 3rem; font-weight: 700 } .note { color: #666 }
table { border-collapse: collapse } td, th { padding: .15rem .9rem .15rem 0; text-align: right }
th:first-child, td:first-child { text-align: left }
.low { color: #b00020; font-weight: 600 } code { font-size: .8rem; color: #666; overflow-wrap: anywhere }
"""
_LOW = 0.9  # share of rollouts below which a cell is marked


def certificate_page(title: str, certificate: Certificate) -> str:
    """The page as HTML, with nothing to load."""
    c, engines = certificate, list(dict.fromkeys(t.engine for t in certificate.tried))
    conditions = dict.fromkeys(t.condition for t in c.tried)
    cells = {(t.condition, t.engine): t.finished for t in c.tried}
    head = "".join(f"<th>{_text(e)}</th>" for e in engines)
    rows = "".join(
        f"<tr><td>{_text(name)}</td>{''.join(_cell(cells.get((name, e))) for e in engines)}</tr>" for name in conditions
    )
    seconds = ", ".join(f"second {at:.0f} ({n} failed)" for at, n in c.hardest) or "none"
    hashes = "".join(f"<li><code>{_text(name)} {_text(value)}</code></li>" for name, value in c.sha256.items())
    low, high = c.finished.interval
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{_text(title)}</title><style>{_STYLE}</style></head><body>
<h1>{_text(title)} on {_text(c.robot)}: what it stands</h1>
<p><span class="big">{100 * c.finished.count / c.finished.of:.1f} %</span> of {c.finished.of} drawn robots dance all
{c.dance_s:.1f} s within the rules (95 % interval {100 * low:.1f} to {100 * high:.1f}).</p>
<p>Falls: {c.fell}. Strays and stands: {c.strayed}. Hardest: {_text(seconds)}.</p>
<h2>One thing changed at a time: share that finishes [%]</h2>
<table><tr><th></th>{head}</tr>{rows}</table>
<h2>What nobody tried</h2><ul>{"".join(f"<li>{_text(x)}</li>" for x in c.not_tried)}</ul>
<h2>For these files and no others</h2><ul>{hashes}<li><code>robot {_text(c.robot_hash)}</code></li></ul>
<p class="note">seed {c.seed}, {c.minutes:.1f} min, {_text(", ".join(f"{k} {v}" for k, v in c.versions.items()))}</p>
</body></html>
"""


def _cell(share: object) -> str:
    if share is None:
        return "<td></td>"
    part = share.count / share.of  # type: ignore[attr-defined]
    return f"<td{' class=low' if part < _LOW else ''}>{100 * part:.0f}</td>"


def _text(text: str) -> str:
    return escape(printable(text))
