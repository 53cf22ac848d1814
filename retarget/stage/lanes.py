"""Lanes over time, and the table of the report, as HTML."""

from __future__ import annotations

from html import escape

from retarget.stage.show import Lane, Show

_ROW, _BAR, _NAME = 15, 9, 118  # height of a lane and of its bar, width of the names [px]


def lanes_svg(show: Show, width: int) -> str:
    """What every edge does and where gates are missed, with seconds below."""
    names, inner = _NAME, width - _NAME - 6
    duration = max(1, show.frames - 1) / show.fps
    rows = [_lane(lane, k, names, inner / max(1, show.frames)) for k, lane in enumerate(show.lanes)]
    bottom = _ROW * len(show.lanes)
    every = next(s for s in (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 3600) if duration / s <= 8 or s == 3600)
    ticks = [
        f'<text x="{names + inner * s / duration:.1f}" y="{bottom + 11}" text-anchor="middle">{s}</text>'
        for s in range(0, int(duration) + 1, every)
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {bottom + 14}" width="100%" '
        f'style="font:10px sans-serif;fill:currentColor">{"".join(rows)}{"".join(ticks)}</svg>'
    )


def playhead(show: Show, frame: int, width: int) -> str:
    """A mark under the lanes at a frame."""
    share = (_NAME + (width - _NAME - 6) * frame / max(1, show.frames - 1)) / width
    return f'<div style="height:9px;margin:-8px 0 0 {100 * share:.2f}%;font:9px sans-serif">&#9650;</div>'


def _lane(lane: Lane, row: int, left: int, pixels: float) -> str:
    y = row * _ROW + (_ROW - _BAR) / 2
    bars = [
        f'<rect x="{left + a * pixels:.1f}" y="{y}" width="{max(1.5, (b - a) * pixels):.1f}" height="{_BAR}" '
        f'fill="rgb{colour}"/>'
        for a, b, colour in lane.stretches
    ]
    name = lane.name if len(lane.name) <= 24 else f"{lane.name[:23]}…"
    return f'<text x="0" y="{y + _BAR - 1}">{escape(name)}</text>{"".join(bars)}'


def report_table(show: Show) -> str:
    """The report's numbers, gates first; what is missed in red."""
    cells = []
    for row in sorted(show.rows, key=lambda r: r.passed is None):
        mark = {True: "✓", False: "✗", None: ""}[row.passed]
        red = ' style="color:rgb(230,55,45)"' if row.passed is False else ""
        limit = f" / {escape(row.limit)}" if row.limit else ""
        cells.append(f"<tr{red}><td>{mark}</td><td>{escape(row.what)}</td><td>{escape(row.value)}{limit}</td></tr>")
    return f'<table style="font:12px sans-serif;border-spacing:6px 1px">{"".join(cells)}</table>'


def legend() -> str:
    """What the colours of lanes and soles mean."""
    kinds = (("60,190,110", "planted"), ("245,170,40", "pivoting"), ("70,160,245", "gliding"), ("230,55,45", "missed"))
    return " ".join(f'<span style="color:rgb({rgb})">■</span> {name}' for rgb, name in kinds)


def inset(content: str) -> str:
    """Content as far from the panel's edge as its other rows."""
    return f'<div style="padding:0 10px;font:11px sans-serif">{content}</div>'
