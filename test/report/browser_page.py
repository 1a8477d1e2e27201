"""A headless Chromium with a page open, driven by the DevTools protocol: it runs scripts, clicks and is looked at."""

import base64
import io
import itertools
import json
import subprocess
import time
import urllib.request

import numpy as np

# Without a graphics card Chromium draws by software, which it does only where it is told to.
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
SECONDS = 60.0  # longest wait for what takes a few


class BrowserPage:
    """The page at ``url``, in a window of 800 by 500."""

    def __init__(self, browser, folder, url):
        from websockets.sync.client import connect

        command = [browser, "--headless", "--no-sandbox", "--disable-gpu", *SOFTWARE, "--remote-debugging-port=0"]
        command += [f"--user-data-dir={folder}", "--window-size=800,500", "--hide-scrollbars", url]
        self._popen = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            told = folder / "DevToolsActivePort"
            until(lambda: told.exists() and told.read_text().strip(), "port of Chromium's DevTools")
            listed = f"http://127.0.0.1:{told.read_text().split()[0]}/json/list"
            pages = until(lambda: [each for each in _json(listed) if each["type"] == "page"], "page in Chromium")
            self._socket = connect(pages[0]["webSocketDebuggerUrl"], max_size=None)
        except BaseException:
            self._popen.kill()
            raise
        self._numbers = itertools.count(1)

    def _do(self, method, **parameters):
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=SECONDS))
            if answer.get("id") == number:
                return answer["result"]

    def go(self, url):
        """Open another page in place of this one."""
        self._do("Page.navigate", url=url)

    def run(self, script):
        """What an expression of JavaScript is."""
        return self._do("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def text(self):
        """All that is written on the page."""
        return self.run("document.body.innerText") or ""

    def wait_for(self, text):
        """Wait until that is written on the page."""
        until(lambda: text in self.text(), f"{text!r} on the page: {self.text()!r}")

    def click(self, label):
        """Press the button with that label, or the box before it."""
        find = f"""(() => {{ const all = [...document.querySelectorAll('button, label, legend, .mantine-Paper-root *')];
            const found = all.filter((one) => one.textContent.trim() === {json.dumps(label)}).pop();
            if (found) found.click(); return Boolean(found); }})()"""
        until(lambda: self.run(find), f"button {label!r} on the page: {self.text()!r}")

    def set_number(self, label, value):
        """Write a number into the field beside a label, as a person does."""
        find = f"""(() => {{ const of = [...document.querySelectorAll('label, div, p, span')].filter(
                (one) => one.textContent.trim() === {json.dumps(label)}).pop();
            const kinds = 'input[inputmode], input[type=text]';
            let row = of; while (row && !row.querySelector(kinds)) row = row.parentElement;
            const field = row && row.querySelector(kinds);
            if (field) {{ field.focus(); field.select(); }} return Boolean(field); }})()"""
        until(lambda: self.run(find), f"field {label!r} on the page: {self.text()!r}")
        self._do("Input.insertText", text=f"{value:g}")
        self.run("document.activeElement.blur()")

    def scene(self):
        """The scene's part of the page as an array (rows, columns, 3) of colours."""
        from PIL import Image

        # viser says there that Chromium draws by software.
        self.run("document.querySelectorAll('.mantine-Notification-root').forEach((one) => one.remove())")
        png = base64.b64decode(self._do("Page.captureScreenshot", format="png")["data"])
        pixels = np.array(Image.open(io.BytesIO(png)).convert("RGB"), int)
        return pixels[:, :450]  # without the panel

    def close(self):
        self._socket.close()
        self._popen.terminate()
        self._popen.wait(SECONDS)


def until(condition, what):
    """What ``condition`` returns once it is true; OSErrors are as good as not yet."""
    deadline = time.monotonic() + SECONDS
    while True:
        try:
            if found := condition():
                return found
        except OSError:
            pass
        assert time.monotonic() < deadline, f"no {what}"
        time.sleep(0.05)


def _json(url):
    with urllib.request.urlopen(url, timeout=10.0) as answer:
        return json.loads(answer.read())


def differing(one, other):
    """Share of the pixels of two pictures that differ by more than a shade."""
    return float((np.abs(one - other).max(axis=2) > 12).mean())
