"""Compiles what sees Fast DDS against version 3 on a machine that has version 2: part of .ci/run.

Headers, CMake files and the code generator come from Debian 13's packages, unpacked in the cache of the user and kept
there. CMake configures a second build tree with them, so it chooses the files and options itself. Nothing is linked or
run: the libraries need Debian 13's C library. Needs the network once, no root. Beside the packages stands the stamp of
the last check that passed: if the same files would be compiled with the same options, nothing is."""

import argparse
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import tree

SUITE = "trixie"
KEYRING = "/usr/share/keyrings/debian-archive-keyring.gpg"
WANTED = ["libfastdds-dev", "libfastcdr-dev", "libfoonathan-memory-dev", "fastddsgen"]
# Packages of these that belong to Fast DDS; this machine has the others.
NEEDED = re.compile(r"(lib(fastdds|fastcdr|foonathan-memory)[\w.+-]*|libeprosima-idl-parser-java|lib(antlr|stringtemplate)[\w.+-]*"
                    r"|libgson-java|libicu4j-java|libtreelayout-java|fastddsgen)")
FOLDERS = ("common/bus", "idl", "tools/doctor")  # all their files; of others those whose text names Fast DDS
NAMES_FAST_DDS = re.compile(r"eprosima|fastdds|fastrtps|fastcdr")
# The generator's own class path names the parser of this machine: the unpacked one must come first.
GENERATOR = """#!/bin/sh
exec java -cp '{unpacked}/usr/share/java/*:{unpacked}/usr/share/fastddsgen/fastddsgen.jar' com.eprosima.fastdds.fastddsgen "$@"
"""


def run(command, what, **options):
    """@throws tree.Failure with the first error that it prints."""
    done = subprocess.run(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          check=False, **options)
    if done.returncode != 0:
        errors = re.findall(r"^(?:E: .*|W: Failed to fetch.*|.*error: .*|CMake Error.*\n.*)", done.stdout, re.MULTILINE)
        lines = errors or done.stdout.strip().splitlines()[-1:]
        raise tree.Failure(f"{what}: {'; '.join(' '.join(line.split()) for line in lines[:3])}")
    return done.stdout


def apt(folder, *words, **options):
    """apt of Debian 13, with its lists in `folder`; it does not see this machine's packages."""
    for name in ("lists/partial", "archives/partial", "empty.d"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "status").touch()
    (folder / "sources.list").write_text(f"deb [signed-by={KEYRING}] {tree.find_mirror()} {SUITE} main\n")
    settings = {"Dir::State": folder, "Dir::State::lists": folder / "lists", "Dir::State::status": folder / "status",
                "Dir::Cache": folder, "Dir::Etc::SourceList": folder / "sources.list",
                "Dir::Etc::SourceParts": folder / "empty.d", "Dir::Etc::Preferences": "/dev/null",
                "Dir::Etc::PreferencesParts": folder / "empty.d", "APT::Sandbox::User": "",
                "Acquire::Languages": "none"}
    flags = [part for name, value in settings.items() for part in ("-o", f"{name}={value}")]
    return run([words[0], *flags, *words[1:]], " ".join(words[:2]), **options)


def list_packages(folder):
    """WANTED and the packages of Fast DDS that they depend on."""
    said = apt(folder, "apt-cache", "depends", "--recurse", "--no-recommends", "--no-suggests", "--no-conflicts",
               "--no-breaks", "--no-replaces", "--no-enhances", *WANTED)
    return sorted(name for name in set(re.findall(r"^(\S+)$", said, re.MULTILINE)) if NEEDED.fullmatch(name))


def unpack(folder):
    """Brings the packages into folder/unpacked, if they are not there. Returns it."""
    unpacked = folder / "unpacked"
    if unpacked.is_dir():
        return unpacked
    print("downloading Fast DDS 3 from Debian 13", file=sys.stderr)
    part, files = folder / "part", folder / "files"
    for one in (part, files):
        shutil.rmtree(one, ignore_errors=True)
        one.mkdir(parents=True)
    apt(folder, "apt-get", "update", "--error-on=any")
    apt(folder, "apt-get", "download", *list_packages(folder), cwd=files)
    for file in sorted(files.glob("*.deb")):
        run(["dpkg-deb", "-x", file, part], file.name)
    # The compiler of this machine does not look into the folder of the architecture below another include folder.
    for headers in (part / "usr/include").glob("*-linux-gnu*"):
        shutil.copytree(headers, part / "usr/include", dirs_exist_ok=True)
    for file in (part / "usr/lib").rglob("*.cmake"):  # Debian's have absolute paths
        file.write_text(file.read_text(encoding="utf-8").replace('"/usr', f'"{unpacked}/usr'), encoding="utf-8")
    generator = part / "usr/bin/fastddsgen"
    generator.write_text(GENERATOR.format(unpacked=unpacked))
    generator.chmod(0o755)
    part.rename(unpacked)
    shutil.rmtree(files)
    return unpacked


def configure(build, unpacked):
    """Configures a build tree with the unpacked packages."""
    places = {f"{path.name}_DIR": path for path in (unpacked / "usr/lib").glob("*/cmake/*")}
    flags = [f"-D{name}={path}" for name, path in places.items()]
    run(["cmake", "-G", "Ninja", "-S", tree.ROOT, "-B", build, "-DSLS_FASTDDS=3", "-DCMAKE_BUILD_TYPE=Release",
         "-DCMAKE_UNITY_BUILD=ON",
         "-DCMAKE_CXX_FLAGS_RELEASE=-O0", f"-DFASTDDSGEN={unpacked}/usr/bin/fastddsgen", *flags], "cmake")


def list_objects(build):
    """The object files of what sees Fast DDS, each with the number of its sources that do. Without tests: those wait
    until programs are linked."""
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        if "/tests/" not in entry["file"] and (count := sum(map(sees_fast_dds, list_sources(entry["file"])))):
            yield re.search(r" -o (\S+)", entry["command"])[1], count


def list_sources(file):
    """The sources that a file of CMAKE_UNITY_BUILD joins, or the file itself."""
    text = pathlib.Path(file).read_text(encoding="utf-8") if "/Unity/unity_" in file else ""
    return [pathlib.Path(name) for name in re.findall(r'^#include "(.*)"$', text, re.MULTILINE) or [file]]


def sees_fast_dds(source):
    name = str(source.relative_to(tree.ROOT)) if source.is_relative_to(tree.ROOT) else ""
    return "/generated/" in name or name.startswith(tuple(f"{folder}/" for folder in FOLDERS)) or (
        source.is_file() and NAMES_FAST_DDS.search(source.read_text(encoding="utf-8", errors="replace")) is not None)


def check_headers(build, objects):
    """@throws tree.Failure if an object was compiled with this machine's own headers of Fast DDS."""
    found = re.findall(r"^(\S+): #deps.*\n(?:    .*\n)*?    (/usr/include/\S*(?:fastdds|fastrtps|fastcdr)/\S+)$",
                       run(["ninja", "-C", build, "-t", "deps", *objects], "ninja"), re.MULTILINE)
    if found:
        raise tree.Failure(f"{found[0][0]}: expected headers of Fast DDS 3, got {found[0][1]}")


def list_read(build, objects):
    """The files of this checkout that the objects are made of."""
    said = run(["ninja", "-C", build, "-t", "deps", *objects], "ninja")
    sources = {os.path.normpath(build / line) for line in re.findall(r"^    (\S+)$", said, re.MULTILINE)}
    names = {os.path.relpath(source, tree.ROOT) for source in sources}
    idl = {str(file.relative_to(tree.ROOT)) for file in (tree.ROOT / "idl").rglob("*") if file.is_file()}
    return sorted(idl | {name for name in names if not name.startswith(("..", "build"))})


def calc_stamp(build, objects, files):
    """SHA-256 of the compile commands and of what the files hold."""
    commands = sorted(f"{entry['command']} {list_sources(entry['file'])}" for entry in json.loads(
        (build / "compile_commands.json").read_text(encoding="utf-8")) if any(name in entry["command"] for name in objects))
    said = hashlib.sha256("\n".join(commands).replace(str(tree.ROOT), "").encode())
    for file in files:
        path = tree.ROOT / file
        said.update(file.encode() + (path.read_bytes() if path.is_file() else b"missing"))
    return said.hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=pathlib.Path, metavar="DIR",
                        default=pathlib.Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "sls/fastdds3",
                        help="where packages and stamp are kept (default: ~/.cache/sls/fastdds3)")
    parser.add_argument("--jobs", type=int, metavar="N", help="compilers at once (default: one more than processors)")
    arguments = parser.parse_args()
    folder = arguments.folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    build, stamp = tree.ROOT / "build/fastdds3", folder / "passed.json"
    try:
        configure(build, unpack(folder))
        found = dict(sorted(list_objects(build)))
        objects = list(found)
        passed = json.loads(stamp.read_text(encoding="utf-8")) if stamp.is_file() else {"files": [], "stamp": ""}
        if passed["stamp"] == calc_stamp(build, objects, passed["files"]):
            print(f"{sum(found.values())} files compile with Fast DDS 3: none has changed since this check passed")
            return 0
        run(["ninja", "-C", build, "-k", "0", *(["-j", arguments.jobs] if arguments.jobs else []), *objects], "compiling")
        check_headers(build, objects)
        files = list_read(build, objects)
        stamp.write_text(json.dumps({"files": files, "stamp": calc_stamp(build, objects, files)}), encoding="utf-8")
    except tree.Failure as failure:
        print(f"fastdds3_check: error: {failure}", file=sys.stderr)
        return 1
    print(f"{sum(found.values())} files compile with Fast DDS 3")
    return 0


if __name__ == "__main__":
    sys.exit(main())
