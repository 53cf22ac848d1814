"""Take a picture of a recording at a moment, without a display: how the pictures of the README were made.

    python scripts/picture.py out/groove.rrd docs/pictures/groove.png --at 5.7

Needs a software Vulkan (Debian: mesa-vulkan-drivers). Rerun's `--screenshot-to` fires while chunks still load, so the
viewer is asked again until two pictures in a row are equal.
"""

from __future__ import annotations

import argparse
import io
import os
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from PIL import Image


def main() -> None:
    """Parse, open a headless viewer, save the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--at", type=float, default=0.0, help="seconds")
    parser.add_argument("--size", default="1400x800")
    parser.add_argument("--bare", action="store_true", help="without the viewer's bars")
    args = parser.parse_args()
    port = _free_port()
    viewer = _open(args.recording, port, args.size)
    try:
        client = _connect(port, viewer)
        client.set_time("seconds", duration=args.at, play_state="paused")
        picture = Image.open(io.BytesIO(_settled(client)))
        width, height = picture.size
        picture.crop((2, 66, width - 2, height - 44) if args.bare else (0, 0, width, height)).save(args.picture)
    finally:
        viewer.terminate()
        viewer.wait(10)


def _free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])


def _open(recording: Path, port: int, size: str) -> subprocess.Popen[bytes]:
    import rerun_cli  # the binary itself: the `rerun` command is a wrapper that would leave its viewer behind

    binary = Path(rerun_cli.__file__).with_name("rerun")
    words = ["--headless", "--hide-welcome-screen", "--bind", "127.0.0.1", "--port", str(port), "--window-size", size]
    environment = {**os.environ, "RUST_LOG": "error", "XDG_RUNTIME_DIR": tempfile.mkdtemp()}
    return subprocess.Popen([str(binary), *words, str(recording)], env=environment, stdout=subprocess.DEVNULL)


def _connect(port: int, viewer: subprocess.Popen[bytes]) -> Any:
    from rerun.experimental import ViewerClient

    for _ in range(600):
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            state = client.get_state()
            if state.recordings and state.recordings[0].timelines and not state.loading and state.views:
                return client
        except (ConnectionError, RuntimeError, ValueError):
            pass
        if viewer.poll() is not None:
            raise SystemExit(f"the viewer ended with {viewer.returncode}")
        time.sleep(0.1)
    raise SystemExit("the viewer did not load the recording")


def _settled(client: Any) -> bytes:
    last = b""
    for _ in range(30):
        picture = bytes(client.take_screenshot(None))
        if picture == last:
            break
        last = picture
        time.sleep(0.2)
    return last


if __name__ == "__main__":
    main()
