"""The scene of a report: the page of sls_view, which contains the recording."""

import html
import os
import subprocess
import tempfile
from pathlib import Path

from sls.launcher.place import say
from sls.recordings import Recording

MOST_BYTES = 4_000_000
"""Limit for a whole report."""
MARGIN = 0.04
"""Share of the scene's bytes that is reserved for escaped characters: the page becomes an HTML attribute."""


def find_program() -> Path | None:
    """The program sls_view, if `./sls report` has built it."""
    program = Path(os.environ.get("SLS_VIEW", ""))
    return program if program.is_file() else None


def make_scene(recording: Recording, most_bytes: int) -> str:
    """A section of at most `most_bytes`; sls_view leaves out steps to reach this size. If there is no
    scene, the section is empty and a line on stderr has the reason."""
    program = find_program()
    if program is None:
        return leave_out("expected the program sls_view, got none (./sls report builds it)")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.html"
        try:
            done = subprocess.run(
                [program, recording.folder, "--export", file, "--most-bytes",
                 str(max(0, int(most_bytes * (1 - MARGIN))))],
                capture_output=True, text=True, timeout=300)
        except (OSError, subprocess.TimeoutExpired) as error:
            return leave_out(str(error))
        if done.returncode != 0:
            lines = done.stderr.strip().splitlines() or ["no message"]
            return leave_out(lines[-1])
        page = file.read_text(encoding="utf-8")
    # An attribute in double quotes needs only these two; html.escape would replace more characters.
    source = page.replace("&", "&amp;").replace('"', "&quot;")
    section = ("<section class=\"screen\"><h2>Scene</h2><iframe class=\"scene\" "
               "title=\"The flight in three dimensions\" "
               f"loading=\"lazy\" srcdoc=\"{source}\"></iframe></section>\n")
    if len(section.encode()) > most_bytes:
        return leave_out(f"expected at most {most_bytes} bytes, got {len(section.encode())}")
    return section


def leave_out(why: str) -> str:
    say(f"report without its scene: {' '.join(why.split())}")
    return ""
