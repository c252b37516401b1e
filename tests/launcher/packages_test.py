"""The launcher names every Debian package that the sources need: `./sls build` and `./sls test` work on a Debian that
has nothing else, also if this machine has more packages.

The closure is what apt-get installs on a minimal Debian for the launcher's lists of packages: their dependencies
without recommendations, essential and required packages, and apt. Each of these must be in the closure: the owners of
headers that the sources include, of what CMake found, of Python modules that are imported, of programs that sources
and scripts start, and of files that they name by path. Node and npm may come from elsewhere, as in `install_node`;
scripts use nothing newer than Debian's Node."""

import ast
import functools
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import unittest

from places import BUILD, ROOT

LAUNCHER = (ROOT / "sls").read_text(encoding="utf-8")
CODENAME = re.search(r'^VERSION_CODENAME="?(\w+)"?$', pathlib.Path("/etc/os-release").read_text(encoding="utf-8"), re.MULTILINE)[1]
# On Ubuntu it is a snap, which the launcher does not install.
WITHOUT = {"chromium"} if CODENAME in ("noble", "resolute") else set()
FASTDDS = re.search(rf"\[{CODENAME}\]=([\w-]+)", LAUNCHER)[1]
FLIGHT = ("idl", "common", "sim_server", "control_client", "recorder", "closed_loop")  # sources of a flight
LISTS = {name: words.split() for name, words in re.findall(r"readonly (\w*packages)=\(([^)]*)\)", LAUNCHER)}
NODE = {"nodejs", "npm"}
DOCKER = {"docker.io", "docker-cli", "docker-compose"}  # installed by hand: docker/README.md


# Words of prose and of code that are also names of programs.
NO_PROGRAMS = {"GET", "HEAD", "POST", "column", "dask", "less", "look", "tape", "time", "view", "write", "zstd"}
WORD = r"[a-zA-Z][\w.+-]*"
# Words where a shell expects a command.
SHELL_COMMAND = re.compile(rf"(?:^|[;|&({{!`'\"]|\b(?:then|do|else|exec|if|while|-v|env|--)) *({WORD})(?=[\s;)'\"]|$)",
                           re.MULTILINE)
CPP_LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
SYSTEM_PATH = re.compile(r"(?<![\w.}/>])(?:/usr/|/bin/|/sbin/|/lib/|/etc/)[\w./+-]*\w")
# Functions that Debian's Node 18 lacks.
NEWER_THAN_NODE_18 = re.compile(
    r"\bzlib\.crc32|\b(?:crc32|globSync)\b.*\bnode:|\.(?:toSorted|toReversed|toSpliced|groupBy|withResolvers|fromAsync|"
    r"isWellFormed|isSubsetOf|symmetricDifference)\(|\bAbortSignal\.any|\bimport\.meta\.(?:dirname|filename)")
# Python functions whose first argument is a command.
STARTS = re.compile("_?(which|run|Popen|call|start|isolate|system|check|exec)")


# --- what the launcher brings ---------------------------------------------------------------------


def list_named():
    """Packages of all lists but that of ./sls fuzz."""
    names = sum((words for name, words in LISTS.items() if name != "fuzz_packages"), [FASTDDS])
    return [name for name in names if name not in WITHOUT]


@functools.cache
def read_installed():
    """Installed packages: name → fields of dpkg's status file."""
    installed = {}
    for paragraph in pathlib.Path("/var/lib/dpkg/status").read_text(encoding="utf-8").split("\n\n"):
        fields = dict(re.findall(r"^([\w-]+): *(.*)$", paragraph, re.MULTILINE))
        if fields.get("Status", "").endswith(" installed"):
            installed[fields["Package"]] = fields
    return installed


@functools.cache
def find_providers():
    """Virtual package → installed packages that provide it."""
    providers = {}
    for package, fields in read_installed().items():
        for name in re.findall(r"(?:^|, *)([\w.+-]+)", fields.get("Provides", "")):
            providers.setdefault(name, []).append(package)
    return providers


def find_needed(package):
    """The packages that one depends on: of alternatives the first that is installed, as apt-get prefers."""
    fields = read_installed()[package]
    for clause in filter(None, re.split(r", *", f"{fields.get('Depends', '')}, {fields.get('Pre-Depends', '')}")):
        names = re.findall(r"(?:^|\| *)([\w.+-]+)", clause)
        found = [name for name in names if name in read_installed()] or [
            provider for name in names for provider in find_providers().get(name, [])]
        yield from found[:1]


def calc_closure(packages):
    base = {package for package, fields in read_installed().items()
            if fields.get("Essential") == "yes" or fields.get("Priority") == "required"}
    closure, left = set(), list(base | {"apt"} | read_installed().keys() & set(packages))
    while left:
        package = left.pop()
        if package not in closure:
            closure.add(package)
            left.extend(find_needed(package))
    return closure | NODE


@functools.cache
def closure_of(what):
    flight = [*LISTS["flight_packages"], FASTDDS]
    return calc_closure({"flight": flight, "build": flight + LISTS["packages"], "tests": list_named()}[what])


@functools.cache
def find_owners():
    """Path → packages that have it."""
    owners = {}
    for listing in pathlib.Path("/var/lib/dpkg/info").glob("*.list"):
        package = listing.stem.partition(":")[0]
        for path in listing.read_text(encoding="utf-8").split("\n"):
            owners.setdefault(to_usr(path), set()).add(package)
    return owners


def to_usr(path):
    """/bin, /sbin and /lib are links to the folders in /usr."""
    return re.sub(r"^/(bin|sbin|lib|lib64)/", r"/usr/\1/", str(path))


def owners_of(path):
    """The packages that have a file or folder, possibly behind a link of update-alternatives."""
    return find_owners().get(to_usr(path)) or find_owners().get(to_usr(os.path.realpath(path)), set())


# --- what the sources need ------------------------------------------------------------------------


@functools.cache
def list_sources(*suffixes):
    sources = []
    for folder, folders, files in os.walk(ROOT):
        folders[:] = sorted(name for name in folders if not name.startswith("build") and name not in (
            ".git", "campaigns", "mine", "node_modules", "recordings", "__pycache__"))
        sources += [pathlib.Path(folder, name) for name in sorted(files)]
    return [source for source in sources if source.suffix in suffixes]


@functools.cache
def read(path):
    return path.read_text(encoding="utf-8", errors="replace")


def is_for_tests(path):
    """True for files that `./sls test` needs, but `./sls build` does not."""
    return path.relative_to(ROOT).parts[0] in ("tests", "bench", "examples")


@functools.cache
def list_include_folders():
    """Where the compiler looks: folders of this build, then its own."""
    folders = []
    for entry in json.loads((BUILD / "compile_commands.json").read_text(encoding="utf-8")):
        words = shlex.split(entry["command"])
        folders += [word[2:] for word in words if word.startswith("-I") and len(word) > 2]
        folders += [words[place + 1] for place, word in enumerate(words[:-1]) if word == "-isystem"]
    own = subprocess.run(["g++", "-E", "-v", "-x", "c++", "/dev/null"], capture_output=True, text=True, check=True)
    return list(dict.fromkeys(folders + re.findall(r"^ (/.*)$", own.stderr, re.MULTILINE)))


@functools.cache
def find_header(name):
    """The path of a header of the system, "" for one that this tree has or generates."""
    if name.partition("/")[0] == "sls":  # installed from this tree
        return ""
    for folder in list_include_folders():
        path = os.path.join(folder, name)
        if os.path.isfile(path):
            return path if path.startswith("/usr/") else ""
    return ""


def list_python_commands(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.List, ast.Tuple)) and len(node.elts) > 1:
            first = node.elts[0]
        elif isinstance(node, ast.Call) and node.args and STARTS.match(
                getattr(node.func, "attr", getattr(node.func, "id", ""))):
            first = node.args[0]
        else:
            first = None
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and re.search("[;&|$]", node.value):
                yield from SHELL_COMMAND.findall(node.value)
        if isinstance(first, ast.Constant) and isinstance(first.value, str):
            yield first.value


def list_commands(path):
    """Words of a file that may be programs which it starts."""
    text = read(path)
    if path.suffix == ".py":
        return set(list_python_commands(text))
    if path.suffix in (".cpp", ".hpp"):
        literals = CPP_LITERAL.findall(re.sub("^ *//.*$", "", text, flags=re.MULTILINE)) if is_for_tests(path) else []
        return {word for literal in literals for word in SHELL_COMMAND.findall(literal)}
    if path.suffix == ".sh" or path.name == "Dockerfile" or re.match("#!.*sh\n", text):
        return set(SHELL_COMMAND.findall(re.sub("^ *#.*$", "", text, flags=re.MULTILINE)))
    return set()


class PackagesTest(unittest.TestCase):
    maxDiff = None

    def expect_in_closure(self, needed, fewest):
        """`needed`: tuples of name, path and the file that needs it."""
        self.assertGreaterEqual(len({name for name, _, _ in needed}), fewest)
        self.assertEqual(sorted(
            f"{source.relative_to(ROOT)}: {name}: in {', '.join(sorted(owners_of(path))) or 'no package'}"
            for name, path, source in needed if not owners_of(path) & closure_of("tests")), [])

    def test_every_package_of_the_launcher_is_installed(self):
        self.assertGreater(len(list_named()), 40)
        self.assertEqual([package for package in list_named() if package not in read_installed()], [])

    def test_a_package_without_a_name_in_the_launcher_is_outside(self):
        # The closure must be smaller than what is installed, and what builds must be smaller than what tests.
        for less, more in ((closure_of("flight"), closure_of("build")), (closure_of("build"), closure_of("tests"))):
            self.assertLess(less & read_installed().keys(), more & read_installed().keys())
        self.assertNotIn("libgtest-dev", calc_closure(["cmake"]))
        version = subprocess.run(["g++", "-dumpversion"], capture_output=True, text=True, check=True).stdout.strip()
        self.assertIn(f"libstdc++-{version}-dev", calc_closure(["g++"]))

    def test_headers_are_of_named_packages(self):
        needed = set()
        for source in list_sources(".c", ".cpp", ".h", ".hpp"):
            for name in re.findall(r'^ *# *include +[<"]([^>"]+)[>"]', read(source), re.MULTILINE):
                if (source.parent / name).is_file():
                    continue
                header = find_header(name)
                if header:
                    needed.add((name, header, source))
        self.expect_in_closure(needed, 100)
        self.assertEqual(sorted(f"{source.relative_to(ROOT)}: {name}" for name, header, source in needed
                                if not is_for_tests(source) and "fuzzer" not in name
                                and not owners_of(header) & closure_of("build")), [], "needed by ./sls build")
        self.assertEqual(sorted(f"{source.relative_to(ROOT)}: {name}" for name, header, source in needed
                                if source.relative_to(ROOT).parts[0] in FLIGHT
                                and not owners_of(header) & closure_of("flight")), [], "needed by ./sls demo")

    def test_files_that_cmake_found_are_of_named_packages(self):
        cache = BUILD / "CMakeCache.txt"
        found = re.findall(r"^(\w+):(?:FILEPATH|PATH)=(/usr/[^;\n]+)$", read(cache), re.MULTILINE)
        self.expect_in_closure({(name, path, ROOT / "CMakeLists.txt") for name, path in found
                                if name != "CMAKE_INSTALL_PREFIX"}, 10)

    def test_python_modules_are_of_named_packages(self):
        sources = list_sources(".py")
        own = {"_sls_core", *(path.stem for path in sources), *(path.parent.name for path in sources)}
        needed = set()
        for source in sources:
            nodes = list(ast.walk(ast.parse(read(source))))
            names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
            names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
            for name in {name.partition(".")[0] for name in names} - own - set(sys.stdlib_module_names):
                place = f"/usr/lib/python3/dist-packages/{name}"
                needed.add((name, place if os.path.isdir(place) else f"{place}.py", source))
        self.expect_in_closure(needed, 5)

    def test_packages_without_which_a_test_is_skipped_are_named(self):
        needed = {package for source in list_sources(".cpp", ".hpp") if is_for_tests(source)
                  for names in re.findall(r"(?:GTEST_SKIP|k[A-Z]\w+ = ).*(?:Debian package|apt-get install) ([a-z0-9.+ -]+)",
                                          read(source))
                  for package in names.split()}
        self.assertGreaterEqual(needed, {"cyclonedds-dev", "libfaketime"})
        self.assertEqual(needed - set(list_named()), set())

    def test_scripts_use_nothing_newer_than_the_node_of_debian(self):
        scripts = list_sources(".mjs")
        self.assertGreaterEqual(len(scripts), 10)
        self.assertEqual([f"{script.relative_to(ROOT)}: {found.group(0)}" for script in scripts
                          for found in NEWER_THAN_NODE_18.finditer(read(script))], [])

    def test_programs_and_paths_are_of_named_packages(self):
        programs = {name: f"{folder}/{name}" for folder in ("/usr/sbin", "/usr/bin") for name in os.listdir(folder)}
        others = {*LISTS["fuzz_packages"], *DOCKER}
        needed = set()
        for source in list_sources(".c", ".cpp", ".hpp", ".mjs", ".py", ".sh", ""):
            needed |= {(name, programs[name], source) for name in list_commands(source) & programs.keys() - NO_PROGRAMS}
            needed |= {(path, path, source) for path in SYSTEM_PATH.findall(read(source)) if owners_of(path)}
        names = {name for name, _, _ in needed}
        self.assertGreaterEqual(names, {"chromium", "codespell", "debootstrap", "git", "ip", "mandoc", "munged", "nft",
                                        "openssl", "slurmctld", "unshare", "/usr/bin/python3"} - WITHOUT)
        self.expect_in_closure({one for one in needed if not owners_of(one[1]) & others}, 50)
