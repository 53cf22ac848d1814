"""A browser without a head, driven over its debugging protocol: enough to open a page, read it, click, and take a picture."""

import base64
import contextlib
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


class Browser:
    """One tab.

    Args:
        network: whether it may reach anything but the page's own address.
        size: of the window [px].
    """

    def __init__(self, url, size=(1280, 800), network=True):
        from websockets.sync.client import connect

        self._home = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        words = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                 "--remote-debugging-port=0", f"--user-data-dir={self._home.name}",
                 f"--window-size={size[0]},{size[1]}"]  # fmt: skip
        words += [] if network else ["--host-resolver-rules=MAP * ~NOTFOUND"]
        self._process = subprocess.Popen(
            [CHROMIUM, *words, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        port = self._port()
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
            tabs = json.load(answer)
        where = next(tab["webSocketDebuggerUrl"] for tab in tabs if tab["type"] == "page")
        self._wire, self._asked, self.fetched, self.said = connect(where, max_size=None), 0, [], []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.ask(f"{domain}.enable")
        self.ask("Page.navigate", url=url)

    def _port(self):
        file = Path(self._home.name) / "DevToolsActivePort"
        for _ in range(200):
            with contextlib.suppress(OSError, IndexError, ValueError):
                return int(file.read_text().split()[0])
            time.sleep(0.1)
        raise TimeoutError("Chromium does not answer")

    def ask(self, method, **params):
        self._asked += 1
        self._wire.send(json.dumps({"id": self._asked, "method": method, "params": params}))
        while True:
            told = json.loads(self._wire.recv(timeout=120))
            if told.get("method") == "Network.requestWillBeSent":
                self.fetched.append(told["params"]["request"]["url"])
            if told.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                self.said.append(json.dumps(told["params"])[:500])
            if told.get("id") == self._asked:
                return told.get("result", told)

    def js(self, code):
        """What an expression comes to; promises are awaited."""
        told = self.ask("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        return told["result"].get("value")

    @property
    def text(self):
        return self.js("document.body ? document.body.innerText : ''") or ""

    def wait(self, for_what, seconds=60.0):
        """Until a text is on the page, or an expression is true; what it came to."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            found = for_what in self.text if not for_what.startswith("js:") else self.js(for_what[3:])
            if found:
                return found
            time.sleep(0.2)
        raise AssertionError(f"{for_what!r} never came; the page says:\n{self.text[:2000]}\n{self.said[-3:]}")

    def click(self, text, nth=0):
        """The nth thing to click that is called so."""
        hit = self.js(
            "(() => { const all = [...document.querySelectorAll('button, label, [role=button], summary')]"
            f".filter(e => e.innerText.trim() === {json.dumps(text)}); const e = all[{nth}]; if (!e) return false;"
            " e.click(); return true; })()"
        )
        assert hit, f"nothing called {text!r} among {self.text[:2000]}"

    def picture(self, path):
        shot = self.ask("Page.captureScreenshot", format="png")
        path.write_bytes(base64.b64decode(shot["data"]))
        return path

    def close(self):
        with contextlib.suppress(Exception):
            self._wire.close()
        self._process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(10)
        self._process.kill()
        self._home.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
