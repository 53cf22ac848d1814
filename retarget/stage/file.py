"""A show as one HTML file that opens from disk and fetches nothing."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path

from clips import write_whole
from retarget.stage.lanes import lanes_svg, legend, report_table
from retarget.stage.page import close_server, look_from_the_front, open_server
from retarget.stage.scene import Scene
from retarget.stage.show import Show
from robot_models.maths import Progress, silent

_FPS = 25.0  # of the file's pictures, at most
_WIDE = 900  # of the lanes [px]


def save_page(path: Path, show: Show, progress: Progress = silent) -> None:
    """Write the show: it plays by itself, and turns under the mouse; lanes and report stand below.

    Args:
        path: the file; whole or absent.
        show: what there is to see.
        progress: told after every frame.

    Raises:
        OutputError: viser is not installed, or the file cannot be written.
    """
    server = open_server("127.0.0.1", 0)
    try:
        look_from_the_front(server, show)
        scene = Scene(server.scene, show)
        recorder, every = server.get_scene_serializer(), max(1, round(show.fps / _FPS))
        for frame in range(0, show.frames, every):
            scene.go_to(frame)
            recorder.insert_sleep(every / show.fps)
            progress("page", frame + 1, show.frames)
        player = recorder.as_html()
    finally:
        close_server(server)
    with write_whole(path) as stream:
        stream.write(_page(show, player).encode())


def _page(show: Show, player: str) -> str:
    """The player in a frame of its own, by a blob: as an attribute it would be three times as long in some browsers."""
    moments = "".join(f"<li>{seconds:.2f} s: {escape(text)}</li>" for seconds, text in show.moments)
    data = base64.b64encode(player.encode()).decode()
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{escape(show.title)}</title>
<style>body{{font:15px/1.45 system-ui,sans-serif;max-width:960px;margin:1.2em auto;padding:0 1em;color:#222}}
iframe{{width:100%;height:62vh;border:0;border-radius:8px;background:#eee}}h1{{font-size:1.3em;margin:.2em 0}}</style></head>
<body><h1>{escape(show.title)}</h1><p>{escape(show.verdict)}</p>
<iframe id="player" title="the dance"></iframe>
<p>Drag to turn, scroll to come nearer. {legend() if show.lanes else ""}</p>
{lanes_svg(show, _WIDE) if show.lanes else ""}
{f"<ul>{moments}</ul>" if moments else ""}
{report_table(show)}
<script>
const bytes = Uint8Array.from(atob("{data}"), c => c.charCodeAt(0));
document.getElementById("player").src = URL.createObjectURL(new Blob([bytes], {{type: "text/html"}}));
</script></body></html>
"""
