"""Pages in headless Chromium, each in a frame of its own width, asked by a script inside.

Chromium opens no window narrower than 500 px, a frame may be.
"""

import json
import re
import shutil
import subprocess
from html import escape, unescape
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
WIDTHS = (1440, 390)

HERE = Path(__file__).parent
EARLY = (HERE / "before_page.js").read_text(encoding="utf-8")

LATE = (HERE / "after_page.js").read_text(encoding="utf-8")

FRAME = """<!DOCTYPE html><body><script>
addEventListener("message", (e) => {
  const held = document.createElement("pre"); held.className = "answer";
  held.textContent = JSON.stringify(e.data); document.body.append(held);
});
</script>"""


def asked(page: str, ask: list[Any], folder: Path) -> dict[int, dict[str, Any]]:
    """Open a page at each width, do what `ask` says; skip where there is no Chromium."""
    if CHROMIUM is None:
        pytest.skip("no Chromium here: apt-get install chromium")
    frames = []
    for width in WIDTHS:
        late = LATE.replace("ASK", json.dumps(ask)).replace("NUMBER", str(width))
        whole = page.replace("<head>", f"<head><script>{EARLY}</script>", 1)
        whole = whole.replace("</body>", f"<script>{late}</script></body>")
        held = f'srcdoc="{escape(whole)}"'
        frames.append(f'<iframe width="{width}" height="900" {held}></iframe>')
    file = folder / "frames.html"
    file.write_text(FRAME + "\n".join(frames), encoding="utf-8")
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
        "--window-size=1600,1200", f"--user-data-dir={folder / 'profile'}",
        "--virtual-time-budget=20000", "--dump-dom", file.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    found = re.findall(r'<pre class="answer">(.*?)</pre>', done.stdout, re.S)
    answers = [json.loads(unescape(one)) for one in found]
    assert len(answers) == len(WIDTHS), done.stderr[-2000:]
    return {one["width"]: one["out"] for one in answers}


def assert_sound(found: dict[int, dict[str, Any]]) -> None:
    """No console error, letters of 12 px at least, whole words, cues, images are there."""
    for width, out in found.items():
        assert out["errors"] == [], width
        assert out["small"] == [], width
        assert out["wide"] == [], width
        assert out["broken"] == [], width
        assert out["uncued"] == [], width
        # An inch of a figure holds 200 dots, its smallest letters are 7 pt
        for natural, shown in out["images"]:
            assert natural, width
            assert shown / (natural / 200) * 7 / 72 >= 12, width
