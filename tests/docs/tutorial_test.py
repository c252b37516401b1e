"""Follows docs/tutorial.md like a reader: it writes every listing to its file, runs every command in its terminal, and
compares the output with the document.

    tests/docs/tutorial_test.py BUILD [--verbose]

Comments in the document, which are not visible in a browser, mark its blocks:

    <!-- file: mine/hop.yaml -->           the block below is written to this file
    <!-- terminal: 2 -->                   its commands run in terminal 2 (default: 1)
    <!-- host: recorder -->                on its own host, a network namespace: only with root
    <!-- needs: hosts -->                  runs only with these hosts
    <!-- exit: 2 -->                       its last command ends with exit code 2 (default: 0)
    <!-- any order -->                     its lines come in any order, because several programs print them
    <!-- waits -->                         the next block waits for the end of its commands, as in terminal 1
    <!-- when 2 shows: TEXT -->            runs only after terminal 2 has printed TEXT
    <!-- checked: page, foxglove -->       then the address must answer with the page, and as a Foxglove server

Lines that begin with `$ ` are commands, `^C` interrupts; the other lines are their output. The output of a command
without output lines is not compared. `…` matches left-out lines, or any text in a line. Numbers in VARYING differ from
flight to flight; everything else must be equal. Terminal 1 waits for each command. Other terminals run at the same
time; they are compared at their next command, and at the end of the chapter. Certificates depend on the type of
processor: a certificate that occurs several times in the document must be the same each time here, too. Numbers of
more than ten decimals are compared to nine digits.

The programs use their own DDS domain (SLS_DOMAIN) and their own port, which replaces 8765. A flight in real time goes
four times as fast.
"""

import base64
import contextlib
import os
import pathlib
import re
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/support"), str(ROOT / "python")]
from own_domain import own_domain  # noqa: E402
from sls.check.hosts import Hosts  # noqa: E402
from sls.errors import RunError  # noqa: E402
from sls.input_error import InputError  # noqa: E402

DOCUMENT = ROOT / "docs/tutorial.md"
PAGE_PORT = "8765"  # the port in the document
REAL_TIME = "--mode realtime"
COMMAND_S = 100  # time limit: longer than any command of the document takes on a busy machine

VARYING = [(re.compile(pattern), name) for pattern, name in (
    (r"\b[0-9a-f]{16}\b", "RUN_ID"),
    (r"on domain \d+", "on domain N"),
    (r"[\d.,]+ steps/s", "RATE steps/s"),
    (r"[\d.]+ × real time", "RATE × real time"),
    (r"simulated in [\d.]+ s", "simulated in TIME s"),
    (r"\b\d+ resent\b", "N resent"),
    (r"\b(resent|duplicate|superseded) +\d+", r"\1 N"),
    (r"round trip( +)p50 [\d.]+ [µm]?s,? +p99 [\d.]+ [µm]?s", "round trip TIMES"),
    (r"real-time factor [\d.]+", "real-time factor X"),
    (r"\(\d+ s left\)", "(N s left)"),
    (r"[\d.]+ s of workers' time, [\d.]+/s", "TIME of workers' time, RATE/s"),
    (r"by \S+@\S+", "by USER@HOST"),
)]


CERTIFICATE = re.compile(r"\b[0-9a-f]{64}\b")
LONG_NUMBER = re.compile(r"\b\d+\.\d{11,}\b")
own_certificates = {}  # certificates of this machine, by those of the document


def make_comparable(line):
    for pattern, name in VARYING:
        line = pattern.sub(name, line)
    return LONG_NUMBER.sub(lambda number: f"{float(number[0]):.9g}", line).rstrip()


def with_own_certificates(shown, came):
    """The shown lines with this machine's certificates. The first time that the document shows a certificate, this
    machine's comes from the printed lines, in their order."""
    printed = [certificate for line in came for certificate in CERTIFICATE.findall(line)]
    for certificate, own in zip((found for line in shown for found in CERTIFICATE.findall(line)), printed):
        if own not in own_certificates.values():
            own_certificates.setdefault(certificate, own)
    return [CERTIFICATE.sub(lambda found: own_certificates.get(found[0], found[0]), line) for line in shown]


# --- the document ---------------------------------------------------------------------------------


class Failure(Exception):
    pass


class Command:
    def __init__(self, text, line):
        self.text, self.line, self.shown = text, line, []


class Block:
    """A fenced block, its line in the document and the marks above it."""

    def __init__(self, kind, line, marks, lines):
        self.kind, self.line, self.marks, self.lines = kind, line, marks, lines
        self.commands = self._split() if kind == "console" else []

    def _split(self):
        commands = []
        for line, text in enumerate(self.lines, self.line + 1):
            if commands and commands[-1].text.endswith("\\\n"):
                commands[-1].text += text + ("\n" if text.endswith("\\") else "")
            elif text.startswith("$ ") or text == "^C":
                commands.append(Command(text.removeprefix("$ ") + ("\n" if text.endswith("\\") else ""), line))
            elif commands:
                commands[-1].shown.append(text)
            else:
                raise Failure(f"{line}: expected a line that begins with '$ ', got '{text}'")
        return commands


def read_document(text):
    """The blocks of the document in order. A chapter's heading is None."""
    steps, marks, lines = [], {}, text.split("\n")
    at = 0
    while at < len(lines):
        line = lines[at]
        if line.startswith("## "):
            steps.append(None)
        elif found := re.fullmatch(r"<!-- (when \S+ shows|[a-z]+(?: order)?)(?:: (.*))? -->", line):
            if found[1].startswith("when "):
                marks.setdefault("when", []).append((found[1].split()[1], found[2]))
            else:
                marks[found[1]] = found[2]
        elif line.startswith("```"):
            end = lines.index("```", at + 1)
            kind = line[3:]
            if kind in ("yaml", "python", "c") and "file" not in marks:
                raise Failure(f"{at + 1}: a listing without <!-- file: … -->")
            steps.append(Block(kind, at + 1, marks, lines[at + 1:end]))
            marks, at = {}, end
        elif line.strip() and marks and not line.startswith("<!--"):
            raise Failure(f"{at + 1}: marks without a block: {marks}")
        at += 1
    return steps


# --- comparison of output and document ------------------------------------------------------------


def to_pattern(line):
    return ".*".join(map(re.escape, make_comparable(line).split("…")))


def find_difference(shown, came, is_any_order):
    """The first difference between printed and shown lines, or None."""
    shown = with_own_certificates(shown, came)
    came = [make_comparable(line) for line in came]
    if is_any_order:
        left = list(came)
        for line in shown:
            if line.strip() == "…":
                continue
            found = next((other for other in left if re.fullmatch(to_pattern(line), other)), None)
            if found is None:
                return f"no line '{line}'"
            left.remove(found)
        if left and "…" not in (line.strip() for line in shown):
            return f"not shown: '{left[0]}'"
        return None
    # Dynamic programming: the set of positions in `came` that are possible after each shown line.
    reached = {0}
    for line in shown:
        if line.strip() == "…":
            reached = set(range(min(reached), len(came) + 1))
            continue
        pattern = to_pattern(line)
        after = {at + 1 for at in reached if at < len(came) and re.fullmatch(pattern, came[at])}
        if not after:
            return f"expected '{line}'"
        reached = after
    return None if len(came) in reached else f"not shown: '{came[max(reached)]}'"


# --- terminals ------------------------------------------------------------------------------------

# Reads commands, each ended by a zero byte, from descriptor 3, and prints the exit code after each.
SHELL = r"""
while IFS= read -r -d '' -u 3 command; do
  eval "$command" 3<&-
  printf '\n%s %d\n' "$END_OF_COMMAND" $?
done
"""


class Terminal:
    """A shell, which runs until the end of the document."""

    def __init__(self, name, folder, environment, before=()):
        self.name, self.lines, self.begin, self.pending = name, [], 0, []
        self.end_of_command = "end-of-command-" + secrets.token_hex(8)
        self.changed = threading.Condition()
        read_end, self.write_end = os.pipe()
        self.process = subprocess.Popen(
            [*before, "bash", "--norc", "-c", f"exec 3<&{read_end}-\n{SHELL}"], cwd=folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, pass_fds=[read_end], start_new_session=True,
            env={**environment, "END_OF_COMMAND": self.end_of_command})
        os.close(read_end)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            with self.changed:
                self.lines.append(line.decode(errors="replace").rstrip("\n"))
                self.changed.notify_all()
        with self.changed:
            self.lines.append(None)
            self.changed.notify_all()

    def start(self, command, exit_code, is_any_order):
        os.write(self.write_end, command.text.replace("\\\n", " ").encode() + b"\0")
        self.pending.append((command, exit_code, is_any_order))

    def find_end(self):
        """Index of the line that ends the oldest command, or None."""
        for at in range(self.begin, len(self.lines)):
            if self.lines[at] is None:
                raise Failure(f"terminal {self.name} is gone")
            if self.lines[at].startswith(self.end_of_command):
                return at
        return None

    def finish(self, timeout_s=COMMAND_S):
        """Waits for the pending commands and compares what they printed."""
        while self.pending:
            command, exit_code, is_any_order = self.pending.pop(0)
            with self.changed:
                if not self.changed.wait_for(lambda: self.find_end() is not None, timeout_s):
                    raise Failure(f"{command.line}: '{command.text}' has not ended within {timeout_s} s; it "
                                  "printed\n" + "\n".join(map(str, self.lines[self.begin:])))
                end = self.find_end()
                came = self.lines[self.begin:end]
                code = int(self.lines[end].split()[1])
            self.begin = end + 1
            if came and came[-1] == "":  # the shell prints this line end before the exit code
                came.pop()
            while came and not came[-1].strip():
                came.pop()
            said = f"{command.line}: '{command.text}' "
            if code != exit_code:
                raise Failure(said + f"ended with {code}, expected {exit_code}; it printed\n" + "\n".join(came))
            if command.shown:
                difference = find_difference(command.shown, came, is_any_order)
                if difference:
                    raise Failure(said + f"{difference}; it printed\n" + "\n".join(came))

    def wait_for(self, text, begin, timeout_s=COMMAND_S):
        """Waits until a line from index `begin` on contains `text`."""
        with self.changed:
            if not self.changed.wait_for(lambda: any(text in (line or "") for line in self.lines[begin:]),
                                         timeout_s):
                raise Failure(f"terminal {self.name} has not printed '{text}' within {timeout_s} s but\n"
                              + "\n".join(map(str, self.lines)))

    def find_descendants(self):
        found, parents = [], [self.process.pid]
        while parents:
            parent = parents.pop()
            try:
                children = pathlib.Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
            except OSError:
                continue
            found += map(int, children)
            parents += map(int, children)
        return found

    def signal_all(self, number):
        for process in self.find_descendants():
            try:
                os.kill(process, number)
            except ProcessLookupError:
                pass

    def close(self):
        self.signal_all(signal.SIGKILL)
        os.close(self.write_end)
        self.process.kill()
        self.process.wait()
        self.reader.join(10)


# --- hosts, containers, domain --------------------------------------------------------------------


@contextlib.contextmanager
def made_hosts():
    """Context with the hosts of a flight, or the reason why there are none."""
    with contextlib.ExitStack() as stack:
        try:
            hosts = stack.enter_context(Hosts(()))
        except (InputError, RunError, OSError) as error:
            hosts = str(error)
        yield hosts


def find_free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


def expect_page(port):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=20) as page:
        if page.headers.get_content_type() != "text/html" or not page.read():
            raise Failure(f" no page on port {port}")


def expect_foxglove(port):
    """Connects like Foxglove: does the handshake and receives the first message."""
    key = base64.b64encode(secrets.token_bytes(16)).decode()
    with socket.create_connection(("127.0.0.1", int(port)), 20) as connection:
        connection.sendall((f"GET / HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
                            "Origin: https://app.foxglove.dev\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n")
                           .encode())
        received = b""
        while b'"serverInfo"' not in received:
            part = connection.recv(4096)
            if not part:
                raise Failure(f" no Foxglove server on port {port}: {received.decode(errors='replace')}")
            received += part


CHECKS = {"page": expect_page, "foxglove": expect_foxglove}


# --- the run --------------------------------------------------------------------------------------


class Reader:
    """Follows the document in a folder with links to the repository. The reader's files stay in this folder."""

    def __init__(self, folder, build, domain, hosts, is_verbose):
        self.folder, self.hosts, self.is_verbose = folder, hosts, is_verbose
        self.terminals, self.skipped, self.ran = {}, [], 0
        self.port = find_free_port()
        for entry in ROOT.iterdir():
            if not entry.name.startswith((".", "build", "recordings", "campaigns", "mine")):
                (folder / entry.name).symlink_to(entry)
        (folder / "build").symlink_to(build)
        (folder / "home").mkdir()
        self.environment = {**os.environ, "SLS_BUILD": str(build), "SLS_DOMAIN": str(domain), "MPLCONFIGDIR":
                            str(folder / "home"), "LC_ALL": "C.UTF-8"}

    def find_obstacle(self, block):
        needs_hosts = "host" in block.marks or block.marks.get("needs") == "hosts"
        return self.hosts if needs_hosts and isinstance(self.hosts, str) else None

    def find_terminal(self, block):
        host = block.marks.get("host")
        name = block.marks.get("terminal", "1")
        if (name, host) not in self.terminals:
            self.terminals[name, host] = Terminal(name, self.folder, self.environment,
                                                  self.hosts.on(host) if host else ())
        return self.terminals[name, host]

    def follow(self, block):
        marks = block.marks
        if block.kind != "console":
            if "file" in marks:
                file = self.folder / marks["file"]
                file.parent.mkdir(exist_ok=True)
                file.write_text("\n".join(block.lines) + "\n")
            return
        if obstacle := self.find_obstacle(block):
            self.skipped.append(f"line {block.line}: {obstacle}")
            return
        for name, text in marks.get("when", ()):
            next(terminal for (other, _), terminal in self.terminals.items() if other == name).wait_for(
                text, 0)
        terminal = self.find_terminal(block)
        for command in block.commands:
            self.ran += 1
            self.say(f"line {command.line}, terminal {terminal.name}: {command.text}")
            if command.text == "^C":
                terminal.signal_all(signal.SIGINT)
                terminal.finish()
                continue
            terminal.finish()
            command.text = command.text.replace("./sls view", f"./sls view --port {PAGE_PORT}").replace(
                PAGE_PORT, self.port)
            command.text = command.text.replace(REAL_TIME, f"{REAL_TIME} --rtf 4")
            command.shown = [line.replace(PAGE_PORT, self.port) for line in command.shown]
            is_last = command is block.commands[-1]
            terminal.start(command, int(marks.get("exit", 0)) if is_last else 0, "any order" in marks)
            if terminal.name == "1" or "waits" in marks:
                terminal.finish()
        if "checked" in marks:
            terminal.wait_for(f"page: http://127.0.0.1:{self.port}/", terminal.begin)
            try:
                for name in marks["checked"].split(", "):
                    CHECKS[name](self.port)
            except OSError as error:
                raise Failure(f"{block.line}: {error}") from error

    def end_chapter(self):
        for terminal in self.terminals.values():
            terminal.finish()
            deadline = time.monotonic() + 20  # for processes in the background
            while (left := terminal.find_descendants()) and time.monotonic() < deadline:
                time.sleep(0.02)
            if left:
                raise Failure(f"terminal {terminal.name} still runs something at the end of the chapter: {left}")

    def say(self, text):
        if self.is_verbose:
            print(f"{time.monotonic() - self.began:6.1f} s  {text}", flush=True)

    def read(self, steps):
        self.began = time.monotonic()
        try:
            for step in steps:
                if step is None:
                    self.end_chapter()
                else:
                    self.follow(step)
            self.end_chapter()
        finally:
            for terminal in self.terminals.values():
                terminal.close()


def test_the_comparison_itself():
    """Each case: shown lines, printed lines, is any order allowed, are they equal."""
    for shown, came, is_any_order, is_equal in (
            (["a", "b"], ["a", "b"], False, True),
            (["a", "b"], ["b", "a"], False, False),
            (["a", "b"], ["b", "a"], True, True),
            (["a"], ["a", "b"], False, False),
            (["a"], ["a", "b"], True, False),
            (["a", "…"], ["a", "b", "c"], False, True),
            (["…", "c"], ["a", "b", "c"], False, True),
            (["…", "b"], ["a", "b", "c"], False, False),
            (["a … c"], ["a b c"], False, True),
            (["rms 1.62e-01"], ["rms 1.63e-01"], False, False),
            (["4000 steps/s, run 0123456789abcdef"], ["51.5 steps/s, run ffff456789abcdef"], False, True),
            (["certificate 0123456789abcdef00"], ["certificate 0123456789abcdef01"], False, False)):
        assert (find_difference(shown, came, is_any_order) is None) == is_equal, (shown, came)


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    test_the_comparison_itself()
    try:
        steps = read_document(DOCUMENT.read_text())
        with own_domain() as domain, made_hosts() as hosts, tempfile.TemporaryDirectory() as folder:
            reader = Reader(pathlib.Path(folder), build, domain, hosts, "--verbose" in sys.argv)
            reader.read(steps)
            print(f"{reader.ran} commands in {time.monotonic() - reader.began:.0f} s")
            for reason in reader.skipped:
                print(f"left out: {reason}")
    except Failure as failure:
        print(f"docs/tutorial.md:{failure}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
