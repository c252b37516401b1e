"""`./sls demo` in the trees that users have: the programs of a flight alone, with Python modules missing, broken or
there. A verdict that cannot be given never changes the exit code of the flight."""

import itertools
import os
import subprocess

from folder_test import FolderTest
from places import BUILD, ROOT

CORE = next((BUILD / "python").glob("_sls_core.*.so"))
MISSING = "raise ModuleNotFoundError(f\"No module named '{__name__}'\", name=__name__)\n"
NOT_BUILT = "expected the module _sls_core: run ./sls python or ./sls build"
# What stands in the build's folder `python`, before Debian's modules: {file: text, or None for the real module of this
# build}, and the reason that the demo gives; None: it gives the verdict.
CASES = {
    "module there": ({CORE.name: None}, None),
    "module missing": ({}, NOT_BUILT),
    "module of another Python": ({"_sls_core.cpython-38-x86_64-linux-gnu.so": None}, NOT_BUILT),
    "module cut short": ({CORE.name: "ELF"}, "file too short"),
    "module too old": ({"_sls_core.py": ""}, "no attribute"),
    "numpy broken": ({CORE.name: None, "numpy.py": "raise ImportError('libblas.so.3: no such file')\n"}, "libblas.so.3"),
    "numpy too old": ({CORE.name: None, "numpy.py": "__version__ = '1.8'\n"}, "numpy"),
    "yaml broken": ({CORE.name: None, "yaml.py": "import nothing_of_this_name\n"}, "nothing_of_this_name"),
    "yaml too old": ({CORE.name: None, "yaml.py": ""}, "yaml"),
    "Python dies": ({CORE.name: None, "yaml.py": "import os\nos.abort()\n"}, "Python ended with -6"),
}
for absent in itertools.chain.from_iterable(itertools.combinations(("numpy", "yaml", "matplotlib"), n) for n in (1, 2, 3)):
    needed = sorted({"numpy", "yaml"} & {*absent}, key=["yaml", "numpy"].index)
    CASES[f"without {', '.join(absent)}"] = ({CORE.name: None, **{f"{name}.py": MISSING for name in absent}},
                                             f"No module named '{needed[0]}'" if needed else None)


class DemoTest(FolderTest):
    def setUp(self):
        super().setUp()
        (self.folder / "build/bin").mkdir(parents=True)
        for program in ("sim_server", "control_client", "recorder", "closed_loop"):
            (self.folder / "build/bin" / program).symlink_to(BUILD / "bin" / program)

    def fly(self, files, **environment):
        modules = self.folder / "build/python"
        modules.mkdir(exist_ok=True)
        for file in modules.iterdir():
            file.unlink()
        for name, text in files.items():
            if text is None:
                (modules / name).symlink_to(CORE)
            else:
                (modules / name).write_text(text)
        return subprocess.run([ROOT / "sls", "demo", "short", "--in-process", "--force", "--out", "r"], cwd=self.folder,
                              env={**os.environ, "SLS_BUILD": str(self.folder / "build"), **environment},
                              capture_output=True, text=True, timeout=60, check=False)

    def expect(self, reason, done):
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("Files in r\n", done.stdout)
        said = [line for line in done.stderr.splitlines() if line.startswith("sls: no verdict on this flight (")]
        self.assertEqual(len(said), reason is not None, done.stderr)
        self.assertEqual("1 flight: 1 held" in done.stdout, reason is None)
        self.assertNotIn("Traceback", done.stdout + done.stderr)
        for line in said:
            self.assertIn(reason, line)
            self.assertTrue(line.endswith("; later: ./sls check short --recording r"), line)

    def test_a_verdict_that_cannot_be_given_leaves_the_exit_code_of_the_flight(self):
        for name, (files, reason) in CASES.items():
            with self.subTest(name):
                self.expect(reason, self.fly(files))

    def test_files_of_the_working_folder_and_variables_of_another_python_shadow_nothing(self):
        other = self.folder / "other"
        other.mkdir()
        for folder, name in itertools.product((self.folder, other), ("_sls_core", "numpy", "yaml", "sls", "csv")):
            (folder / f"{name}.py").write_text("raise SystemExit('shadowed')\n")
        self.expect(None, self.fly({CORE.name: None}, PYTHONPATH=str(other), PYTHONHOME=str(other)))

    def test_a_verdict_that_does_not_hold_is_the_exit_code(self):
        judge = "import sys\nprint('1 flight: 0 held, 1 not held')\nsys.exit(1)\n"
        done = self.fly({CORE.name: None, "yaml.py": judge})
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("1 not held", done.stdout)
