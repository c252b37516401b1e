"""Makes defects in the cores by rule, and says which the scripts of the cores and the worlds find: `./sls mutants`.

Clang names the places: each comparison, condition, operand of && and ||, constant, message, assignment to a member, and
call that only acts. One build holds all defects; the variable SLS_MUTANT switches one on. The table is printed as Markdown."""

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CORES = ("common/sync", "control_client/core", "recorder/core", "sim_server/core")
SCRIPTS = ("sync_test", "client_core_test", "recorder_core_test", "server_core_test", "fault_line_test")
SWAPS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
SWITCH = """#pragma once
#include <cstdlib>
namespace sls_mutants {
inline const int active = [] { const char* text = std::getenv("SLS_MUTANT"); return text ? std::atoi(text) : -1; }();
inline bool on(int id) { return id == active; }
inline const char* text(int id, const char* text) { return on(id) ? "another text" : text; }
template <class T> auto twice(int id, T value) { return on(id) ? static_cast<T>(value + value) : value; }
"""


def make_switch():
    """The header that every file of the build includes."""
    functions = "".join(
        f"template <class A, class B> bool compare{n}(int id, const A& a, const B& b)"
        f" {{ return on(id) ? a {swapped} b : a {operator} b; }}\n" for n, (operator, swapped) in enumerate(SWAPS.items()))
    return SWITCH + functions + "}  // namespace sls_mutants\n"


class Places:
    """The defects of one file: where, by which rule, and what is inserted."""

    def __init__(self, text):
        self.text, self.found = text, {}

    def add(self, rule, begin, end, inserts):
        """`inserts`: (offset, text with {} for the id), outer ones first."""
        self.found.setdefault((begin, end, rule), inserts)

    def text_of(self, begin, end):
        return " ".join(self.text[begin:end].decode().split())


def find_places(clang, file, arguments, places_of):
    """Adds the places of `file`, and of the headers of the cores that it includes, to `places_of`."""
    kinds = clang.CursorKind
    unit = clang.Index.create().parse(str(file), args=arguments)
    if any(message.severity >= 3 for message in unit.diagnostics):
        sys.exit(f"{file}: {next(str(message) for message in unit.diagnostics if message.severity >= 3)}")

    def note(cursor, parent, depth):
        """`depth`: of bodies of functions, 0 outside."""
        place = cursor.location.file and places_of.get(os.path.normpath(cursor.location.file.name))
        if not place and cursor.kind != kinds.TRANSLATION_UNIT:
            return  # of another file
        if place and depth:
            begin, end = cursor.extent.start.offset, cursor.extent.end.offset
            children = list(cursor.get_children())
            note_comparison(place, cursor, children)
            if cursor.kind == kinds.IF_STMT and children[0].kind.is_expression():
                first, last = children[0].extent.start.offset, children[0].extent.end.offset
                for rule, word in (("if (true)", "||"), ("if (false)", "&& !")):
                    place.add(rule, first, last, [(first, "("), (last, f") {word} ::sls_mutants::on({{}})")])
            if parent.kind == kinds.COMPOUND_STMT:
                note_statement(place, cursor, begin, end)
            if cursor.kind == kinds.DECL_REF_EXPR and re.match(r"k[A-Z]", cursor.spelling) and is_number(cursor):
                place.add("twice", begin, end, [(begin, "::sls_mutants::twice({}, "), (end, ")")])
            if cursor.kind == kinds.STRING_LITERAL and b" " in place.text[begin:end]:
                place.add("text", begin, end, [(begin, "::sls_mutants::text({}, "), (end, ")")])
        if cursor.kind in (kinds.CASE_STMT, kinds.STATIC_ASSERT) or "constexpr" in first_tokens(cursor):
            return
        is_body = cursor.kind == kinds.COMPOUND_STMT
        for child in cursor.get_children():
            note(child, cursor, depth + is_body)

    def first_tokens(cursor):
        if cursor.kind not in (kinds.DECL_STMT, kinds.VAR_DECL):
            return ()
        return [token.spelling for token, _ in zip(cursor.get_tokens(), range(3))]

    def is_number(cursor):
        name = cursor.type.get_canonical().spelling
        return "duration" in name or re.sub("const |unsigned |std::", "", name) in ("int", "long", "double", "float")

    def note_comparison(place, cursor, children):
        is_builtin = cursor.kind == kinds.BINARY_OPERATOR and len(children) == 2
        is_overloaded = cursor.kind == kinds.CALL_EXPR and cursor.spelling.startswith("operator") and len(children) == 3
        if not is_builtin and not is_overloaded:
            return
        left, right = children[0].extent, children[-1].extent
        between = place.text[left.end.offset:right.start.offset].decode()
        operator = between.strip()
        at = left.end.offset + between.find(operator)
        if operator in SWAPS:
            function = f"::sls_mutants::compare{list(SWAPS).index(operator)}({{}}, "
            place.add(SWAPS[operator], left.start.offset, right.end.offset,
                      [(left.start.offset, function), (at, ",", len(operator)), (right.end.offset, ")")])
        elif operator in ("&&", "||"):
            for side, extent in (("left", left), ("right", right)):
                first, last = extent.start.offset, extent.end.offset
                word = "||" if operator == "&&" else "&& !"
                place.add(f"no {side} of {operator}", first, last,
                          [(first, "(("), (last, f") {word} ::sls_mutants::on({{}}))")])

    def note_statement(place, cursor, begin, end):
        is_assignment = cursor.kind in (kinds.BINARY_OPERATOR, kinds.COMPOUND_ASSIGNMENT_OPERATOR, kinds.UNARY_OPERATOR)
        if cursor.kind == kinds.CALL_EXPR or is_assignment:
            rule = "no assignment" if is_assignment else "no call"
            place.add(rule, begin, end, [(begin, "if (!::sls_mutants::on({})) ")])

    note(unit.cursor, unit.cursor, 0)


def put_in(places, numbers):
    """The text with the defects of `numbers`: {key of a place: id}."""
    inserts = []
    for (begin, end, rule), id_ in numbers.items():
        for order, (offset, word, *length) in enumerate(places.found[begin, end, rule]):
            # At one offset the ends of inner places come first, then the beginnings of outer ones.
            is_end = offset == end and order > 0
            sign = 1 if is_end else -1
            inserts.append((offset, not is_end, (end - begin) * sign, -sign * len(inserts), word.format(id_), *length))
    text, last = b"", 0
    for offset, _, _, _, word, *length in sorted(inserts, key=lambda insert: insert[:4]):
        text += places.text[last:offset] + word.encode()
        last = max(last, offset + sum(length))
    return text + places.text[last:]


def copy_tree(tree):
    """The sources in a folder of their own, so that no defect is ever in the working tree."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], check=True, capture_output=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        if not (tree / name).is_file() or (tree / name).read_bytes() != (ROOT / name).read_bytes():
            shutil.copy(ROOT / name, tree / name)


def run(*command, limit_s=3600, id_=-1):
    """The exit code, 124 after the limit, and the output."""
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=limit_s, check=False,
                              text=True, errors="replace", env=os.environ | {"SLS_MUTANT": str(id_)})
    except subprocess.TimeoutExpired:
        return 124, ""
    return done.returncode, done.stdout


def build(folder, tree, all_places, numbers):
    """Builds with the defects of `numbers`, without those that do not compile, which are returned."""
    refused = set()
    targets = ["sls_worlds", *SCRIPTS]
    while True:
        for file, places in all_places.items():
            here = {key: id_ for id_, (of_file, key) in numbers.items() if of_file == file and id_ not in refused}
            text = put_in(places, here)
            if (tree / file).read_bytes() != text:
                (tree / file).write_bytes(text)
        code, said = run("ninja", "-k", "0", "-C", folder / "build", *targets)
        if code == 0:
            return refused
        lines = {(os.path.normpath(folder / "build" / file), int(line)) for file, line in
                 re.findall(r"^([^\s:]+):(\d+):\d+: +(?:error|required)", said, re.MULTILINE)}
        bad = {id_ for id_, (file, key) in numbers.items() if id_ not in refused and
               any((str(tree / file), all_places[file].text[:at].count(b"\n") + 1) in lines for at in key[:2])}
        if not bad:
            sys.exit(said[-3000:])
        refused |= bad


def judge(folder, id_, seeds):
    """What found the defect: (scripts, worlds)."""
    by_scripts = [name for name in SCRIPTS
                  if run(folder / "build/tests" / name, "--gtest_fail_fast", limit_s=60, id_=id_)[0] != 0]
    code, said = run(folder / "build/bin/sls_worlds", "--jobs", "1", "--seeds", f"0-{seeds - 1}", "--most", "1",
                     limit_s=600, id_=id_)
    found = re.search(r"^seed (\d+):\n  (\S+):", said, re.MULTILINE)
    by_worlds = "no" if code == 0 else f"{found[2]}, seed {found[1]}" if found else f"exit code {code}"
    return ", ".join(by_scripts) or "no", by_worlds


def main():
    parser = argparse.ArgumentParser(prog="./sls mutants", description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build-mutants", metavar="FOLDER")
    parser.add_argument("--draw", type=int, default=500, metavar="N", help="how many are tried (500)")
    parser.add_argument("--seed", type=int, default=0, help="of the draw (0)")
    parser.add_argument("--seeds", type=int, default=5000, metavar="N", help="worlds that each is flown in (5000)")
    parser.add_argument("--only", default="", metavar="TEXT", help="those whose place or text holds this")
    parser.add_argument("--list", action="store_true", help="only list all places")
    options = parser.parse_args()
    from clang import cindex  # noqa: PLC0415: of Debian's package python3-clang

    folder = options.build.resolve()
    tree = folder / "tree"
    copy_tree(tree)
    (folder / "switch.hpp").write_text(make_switch())
    subprocess.run(["cmake", "-S", tree, "-B", folder / "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                    "-DCMAKE_UNITY_BUILD=OFF", "-DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON",
                    "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DSLS_BUILD_PROGRAMS=OFF",
                    f"-DCMAKE_CXX_FLAGS=-D_GLIBCXX_ASSERTIONS -include {folder / 'switch.hpp'}",
                    "-DCMAKE_CXX_FLAGS_RELEASE=-O1"],
                   check=True, stdout=subprocess.DEVNULL)
    run("ninja", "-C", folder / "build", "sls_idl")
    all_places = {}
    for core in CORES:
        for file in sorted((ROOT / core).rglob("*.?pp")):
            all_places[str(file.relative_to(ROOT))] = Places(file.read_bytes())
    by_path = {str((tree / file).resolve()): places for file, places in all_places.items()}
    for command in json.loads((folder / "build/compile_commands.json").read_text()):
        if command["file"] in by_path:
            flags = [word for word in re.findall(r"(?:-isystem |-[ID])\S+", command["command"])]
            arguments = [part.replace('\\"', '"') for flag in flags for part in flag.split()]
            find_places(cindex, Path(command["file"]), ["-std=c++17", *arguments], by_path)
    # Of places of equal extent a comparison is the innermost, because its operator becomes a comma.
    whole = [(file, key) for file, places in all_places.items()
             for key in sorted(places.found, key=lambda key: (*key[:2], key[2] in SWAPS, key[2]))]

    def describe(file, key):
        places = all_places[file]
        line = places.text[:key[0]].count(b"\n") + 1
        return f"{file}:{line}: {key[2]}: `{places.text_of(*key[:2])[:60].replace('|', '&#124;')}`"

    numbers = {id_: place for id_, place in enumerate(whole) if options.only in describe(*place)}
    if options.list:
        print("\n".join(describe(*place) for place in numbers.values()))
        return
    refused = build(folder, tree, all_places, numbers)
    for name in SCRIPTS:
        code, said = run(folder / "build/tests" / name)
        if code != 0:
            sys.exit(f"{name} fails without a defect:\n{said[-2000:]}")
    chosen = [id_ for id_ in numbers if id_ not in refused]
    chosen = sorted(random.Random(options.seed).sample(chosen, min(options.draw, len(chosen))))
    print(f"{len(whole)} places, {len(refused)} do not compile, {len(chosen)} are tried\n\n"
          "| defect | scripts | worlds |\n| --- | --- | --- |", flush=True)
    count = Counter()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for id_, (scripts, worlds) in zip(chosen, pool.map(lambda id_: judge(folder, id_, options.seeds), chosen)):
            print(f"| {describe(*numbers[id_])} | {scripts} | {worlds} |", flush=True)
            count += Counter({"worlds": worlds != "no", "both": worlds != "no" or scripts != "no"})
    print(f"\nof {len(chosen)} worlds find {count['worlds']}, worlds and scripts {count['both']}")


if __name__ == "__main__":
    main()
