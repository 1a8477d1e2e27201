"""A headless Chromium, where there is one, that runs a script in a page and prints what the page has become."""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "chromium-headless-shell", "google-chrome", "google-chrome-stable", "chrome")


def find():
    """Path of a Chromium: $CHROME, one on the path, or one that playwright has installed; None when there is none."""
    named = [os.environ.get("CHROME"), *map(shutil.which, NAMES)]
    cache = Path(os.environ.get("PLAYWRIGHT_BROWSERS_PATH", Path.home() / ".cache" / "ms-playwright"))
    installed = sorted(map(str, [*cache.glob("chromium*/*/headless_shell"), *cache.glob("chromium*/*/chrome")]))
    return next(filter(None, [*named, *installed]), None)


def ask(browser, page, script, folder):
    """What ``script`` (the body of a function) returns in a copy of the page in ``folder``, and the page's errors."""
    text = page.read_text(encoding="utf-8")
    before = "<script>window.failures = []; window.onerror = (m) => { window.failures.push(m); };</script>"
    after = (
        '<pre id="answer"></pre><script>let found; try { found = (() => {' + script + "})(); } catch (e) {"
        "window.failures.push(String(e)); } document.getElementById('answer').textContent ="
        " JSON.stringify({found: found, failures: window.failures});</script>"
    )
    copy = folder / "asked.html"
    copy.write_text(text.replace("<head>", "<head>" + before, 1).replace("</body>", after + "</body>"), "utf-8")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", copy.as_uri()]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    [answer] = re.findall(r'<pre id="answer">(.*?)</pre>', shown, re.DOTALL)
    found = json.loads(answer.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
    return found.get("found"), found["failures"]
