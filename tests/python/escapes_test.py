"""Texts of a recording that would control a terminal: what a reader prints of them is printable."""

import json
import re
import shutil
import subprocess
from unittest import mock

import support
from places import BUILD, ROOT
from sls.input_error import InputError
from sls.launcher.place import say
from sls.recordings import Recording

# A colour, a window's title, a C1 control as UTF-8, DEL, another direction, a second line.
ESCAPE = "\x1b[31m\x1b]0;title\x07\x9b31m\x7f\u202e\r\nforged"
CONTROL = re.compile("[\0-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ufffd]|^forged", re.MULTILINE)


def list_texts(value, path=()):
    """The place of each text and each key in a document of JSON: the path, and whether it is the key."""
    if isinstance(value, str):
        yield path, False
    for key, item in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from list_texts(item, (*path, key))
        if isinstance(key, str):
            yield (*path, key), True


def change_manifest(text, place):
    manifest = json.loads(text) | {"complete": False}
    (*above, last), is_key = place
    inner = manifest
    for key in above:
        inner = inner[key]
    inner[last + ESCAPE if is_key else last] = inner.pop(last) if is_key else inner[last] + ESCAPE
    return json.dumps(manifest)


def change_table(text, place):
    lines = text.split("\n")
    fields = lines[place[0]].split(",")
    fields[place[1]] += ESCAPE.partition("\r")[0]
    if place[0]:
        fields[place[1]] = f'"{fields[place[1]]}\r\nforged"'
    lines[place[0]] = ",".join(fields)
    return "\n".join(lines)


CHANGES = {"manifest.json": change_manifest,
           "scenario.yaml": lambda text, _: text.replace("name: short", f"name: {json.dumps(ESCAPE)}")}
FIELDS = {"state.csv": (0, 5), "status.csv": (1, 3), "command.csv": (2, 6), "reference.csv": (2, 5), "scenario.yaml": (1, 1)}


class EscapesTest(support.FolderTest):
    def run_program(self, name, *arguments):
        done = subprocess.run([BUILD / "bin" / name, *arguments], cwd=self.folder, capture_output=True, check=False)
        return (done.stdout + done.stderr).decode(errors="replace")

    def list_outputs(self):
        """What the readers print about the recording `r`."""
        yield self.run_program("sls_verify", "r")
        yield self.run_program("sls_verify", "whole", "r")
        yield self.run_program("sls_convert", "r", "--out=r.mcap", "--force")
        with mock.patch("sls.figures.make_figures", return_value={}):
            yield self.run_sls("plot", "r")[1]
        with mock.patch("sls.report.make_report", lambda recording, _: say(
                f"{recording!r} {recording.list_events()} {recording.list_notes()}") or ""):
            yield self.run_sls("report", "r")[1]

    def test_no_text_of_a_file_controls_the_terminal(self):
        self.run_program("closed_loop", f"--scenario={ROOT}/config/scenarios/short.yaml", "--out=whole")
        places = [("manifest.json", place)
                  for place in list_texts(json.loads((self.folder / "whole/manifest.json").read_text()))]
        places += [(name, (line, field)) for name, (line, count) in FIELDS.items() for field in range(count)]
        for name, place in places:
            shutil.rmtree(self.folder / "r", ignore_errors=True)
            shutil.copytree(self.folder / "whole", self.folder / "r")
            file = self.folder / "r" / name
            file.write_text(CHANGES.get(name, change_table)(file.read_text(), place), newline="")
            for output in self.list_outputs():
                self.assertNotRegex(output, CONTROL, (name, place))

    def test_names_of_folders_and_errors_of_the_package_are_printable(self):
        folder = self.folder / "a\x1b[31m\x9b"
        self.assertNotRegex(self.run_sls("plot", folder)[1] + self.run_program("sls_verify", folder), CONTROL)
        with self.assertRaises(InputError) as caught:
            Recording(folder)
        self.assertNotRegex(str(caught.exception), CONTROL)
