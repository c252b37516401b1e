"""Renders pages in Chromium without a window."""

import pathlib
import re
import shutil
import subprocess
import tempfile

PROGRAM = shutil.which("chromium") or shutil.which("google-chrome")
MISSING = "skipped: no Chromium (apt-get install chromium)"

# Fewer processes; the software GPU draws only the scene. Chromium then warns of its own ReadPixels.
LEAN = ("--disable-gpu-compositing", "--in-process-gpu", "--disable-extensions")
DARK = "--blink-settings=preferredColorScheme=0"
NARROW = "--window-size=700,900"
# Added to a copy of the page. After loading it writes its findings into attributes of <body>: number of images, of
# broken images and of requests, the overflow in px, and the colour of the ground.
PROBE = """<script>
addEventListener("load", () => {
  const images = [...document.images];
  document.body.dataset.broken = images.filter(image => !image.naturalWidth).length;
  document.body.dataset.overflow = document.documentElement.scrollWidth
      - document.documentElement.clientWidth;
  document.body.dataset.requests = performance.getEntriesByType("resource")
      .filter(entry => !entry.name.startsWith("data:")).length;
  document.body.dataset.seen = images.length;
  document.body.dataset.ground = getComputedStyle(document.body).backgroundColor;
});
</script>"""


def run(page: pathlib.Path, *flags: str) -> tuple[str, str]:
    """The browser's output (for --dump-dom the page's document) and its log."""
    with tempfile.TemporaryDirectory() as profile:
        done = subprocess.run(
            [PROGRAM, "--headless", "--no-sandbox", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", *LEAN,
             "--window-size=1366,768", f"--user-data-dir={profile}", "--enable-logging=stderr",
             *flags, page.as_uri()], capture_output=True, text=True, timeout=120, check=True)
    return done.stdout, done.stderr


def render(page: pathlib.Path, *flags: str) -> tuple[str, list[str]]:
    """The document after loading, with the probe's findings and without its pictures, and the page's
    messages on the console."""
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / page.name
        copy.write_text(page.read_text().replace("</body>", f"{PROBE}</body>"))
        document, log = run(copy, "--dump-dom", *flags)
    document = re.sub(r'"data:image[^"]*"', '"data:"', document)
    return document, [line for line in log.splitlines() if "CONSOLE" in line and "ReadPixels" not in line]


def count_printed_pages(page: pathlib.Path) -> int:
    """The pages of the printed page."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "page.pdf"
        run(page, f"--print-to-pdf={file}", "--no-pdf-header-footer")
        return len(re.findall(rb"/Type /Page\b", file.read_bytes()))


def take_picture(page: pathlib.Path, picture: pathlib.Path, height: int = 768) -> None:
    run(page, f"--screenshot={picture}", f"--window-size=1366,{height}", "--hide-scrollbars")
