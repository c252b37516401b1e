"""Rules for includes: which folders each folder may include, and what a core may not use. The folders' libraries may link
those of the same folders, without a circle."""

import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Files of a folder may include its own files and these: folders and files of this project, and external libraries. The rule
# of a subfolder takes precedence for its files.
RULES = {
    "bench": ["closed_loop", "common", "control_client", "sim_server", "Wire", "Fast DDS"],
    "closed_loop": ["common", "control_client", "recorder", "sim_server"],
    "common/app": ["common/config", "common/sync", "common/text"],
    "common/bus": ["common/app", "common/config", "common/model", "common/sync", "common/text", "Wire", "Fast DDS"],
    "common/bus/fastdds": ["common/bus/peer.hpp", "common/bus/problems.hpp", "common/bus/spinning.hpp",
                           "common/bus/topics.hpp", "common/config", "common/text", "Wire", "Fast DDS"],
    "common/config": ["common/model", "common/text"],
    "common/model": [],
    "common/models": ["common/config", "control_client/laws/laws.def", "sim_server/autopilots/autopilots.def",
                      "sim_server/plants/plants.def"],
    "common/plugin": ["common/config", "common/model", "common/text"],
    "common/ros": ["common/model", "common/scene", "Fast DDS"],
    "common/scene": ["common/bus", "common/config", "common/model", "common/models"],
    "common/sync": ["common/bus/peer.hpp", "Wire"],
    "common/text": [],
    "control_client": ["common"],
    "control_client/core": ["common/config", "common/sync"],
    "control_client/laws": ["common/config", "common/model", "common/plugin"],
    "python": ["closed_loop", "common", "control_client", "recorder", "sim_server"],
    "recorder": ["common"],
    "recorder/core": ["common/bus/convert.hpp", "common/bus/names.hpp", "common/bus/peer.hpp", "common/model",
                      "common/sync", "recorder/rows.hpp", "Wire"],
    "recorder/sinks/mcap": ["common", "recorder", "Wire", "Fast DDS"],
    "sim_server": ["common", "Wire"],
    "sim_server/autopilots": ["common/config", "common/model", "common/plugin"],
    "sim_server/core": ["common/bus/names.hpp", "common/bus/peer.hpp", "common/bus/sync_counters.hpp",
                        "common/bus/topics.hpp", "common/config", "common/model", "common/sync",
                        "sim_server/plants/plant.hpp", "sim_server/plants/sensing/delay_line.hpp", "Wire"],
    "sim_server/plants": ["common/config", "common/model", "common/plugin", "sim_server/autopilots", "Simbody"],
    "tools/convert": ["common", "recorder"],
    "tools/ctl": ["common"],
    "tools/delay_margin": ["closed_loop", "common"],
    "tools/doctor": ["common", "Wire", "Fast DDS"],
    "tools/reference": ["common/config", "common/models"],
    "tools/verify": ["common", "recorder"],
    "tools/view": ["common", "control_client/reference_trajectory.hpp", "recorder", "tools/ctl"],
    "worlds": ["closed_loop", "common", "control_client", "recorder", "sim_server", "Wire"],
}
# Folders whose files decide only: time and all that happens are arguments (CONTRIBUTING.md).
CORES = ("common/sync", "control_client/core", "recorder/core", "sim_server/core")
NOT_IN_A_CORE = re.compile(r"<(?:thread|mutex|atomic|condition_variable|future|csignal|signal\.h|fstream|iostream|"
                           r"spdlog/spdlog\.h)>|\bnow\(\)|\bsleep")
PRODUCT = ("bench", "closed_loop", "common", "idl", "control_client", "python", "recorder", "sim_server", "tools", "worlds")
# Libraries that only some folders may include, by their headers.
LIBRARIES = {"Wire": re.compile(r"sls\.h$|slsPubSubTypes"), "Fast DDS": re.compile("fast(dds|rtps|cdr)[/_]"),
             "Simbody": re.compile("Simbody|SimTK|simbody/")}
INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]')


def is_below(path, folder):
    return path.startswith(folder + "/")


def find_rule(file):
    """The closest folder above the file that has a rule."""
    return max((folder for folder in RULES if is_below(file, folder)), key=len, default=None)


def is_allowed(file, header, is_ours):
    folder = find_rule(file)
    library = next((name for name, headers in LIBRARIES.items() if headers.match(header)), None)
    if not library and (not is_ours or is_below(header, folder)):
        return True
    return any(other in (library, header) or is_below(header, other) for other in RULES[folder])


def list_files(root, *names):
    return [(path, str(path.relative_to(root))) for top in PRODUCT for name in names
            for path in sorted((root / top).rglob(name))]


def list_findings(root):
    """`FILE:LINE: includes HEADER` for each include that breaks a rule, in the product's folders of `root`."""
    findings = []
    for path, file in list_files(root, "*.cpp", "*.hpp", "*.c", "*.h"):
        if not find_rule(file):
            findings.append(f"{file}: no rule in tests/includes_test.py")
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if any(is_below(file, core) for core in CORES) and (word := NOT_IN_A_CORE.search(line)):
                findings.append(f"{file}:{number}: a core must not use {word[0]}")
            if (found := INCLUDE.match(line)) and not is_allowed(file, found[2], found[1] == '"'):
                findings.append(f"{file}:{number}: includes {found[2]}")
    return sorted(findings)


def read_targets(root):
    """Libraries and programs: {name: (the folder of its CMakeLists.txt, the libraries that it links)}."""
    def read(file):
        return re.sub("#[^\n]*", "", file.read_text())

    folders, links = {}, {}
    for path, file in list_files(root, "CMakeLists.txt"):
        text = read(path)
        if kind := re.search(r"sls_add_models\((\w+)", text):
            text += read(root / "common/models/models.cmake").replace("${kind}", kind[1])
        for command, name, arguments in re.findall(r"(\w+)\(\s*(\w+)(?=[\s)])([^)]*)\)", text):
            if re.fullmatch(r"add_library|add_executable|\w+_add_module|sls_add_wire_types", command):
                folders[name] = str(Path(file).parent)
            if command == "target_link_libraries":
                links.setdefault(name, set()).update(f"sls_{word}" for word in re.findall(r"\bsls(?:::|_)(\w+)", arguments))
    return {name: (folders.get(name, ""), links.get(name, set())) for name in folders.keys() | links.keys()}


def may_link(folder, other):
    """True if files of `folder` may include files of `other`."""
    file = f"{folder}/any.cpp"
    return folder == other or find_rule(file) is not None and (
        is_allowed(file, "sls.h" if other == "idl" else f"{other}/any.hpp", True)
        or any("." in path and str(Path(path).parent) == other for path in RULES[find_rule(file)]))


def list_link_findings(root):
    """`FOLDER: TARGET links LIBRARY` for each link that breaks a rule for includes, and a circle of links."""
    targets = read_targets(root)
    findings = [f"{folder}: {name} links {link}" for name, (folder, links) in sorted(targets.items()) for link in sorted(links)
                if link not in targets or not may_link(folder, targets[link][0])]
    try:
        TopologicalSorter({name: links for name, (_, links) in targets.items()}).prepare()
    except CycleError as error:
        findings.append("a circle of links: " + ", ".join(sorted(set(error.args[1]))))
    return findings


def test_no_library_links_upwards_or_in_a_circle():
    assert list_link_findings(ROOT) == []
    assert len(read_targets(ROOT)) > 40


def test_no_file_includes_upwards():
    assert list_findings(ROOT) == []


def write_files(root, files):
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)


def test_each_link_that_breaks_a_rule_is_found(tmp_path):
    write_files(tmp_path, {
        "common/model/CMakeLists.txt": "add_library(sls_model STATIC a.cpp)\n# sls::config\n"
                                       "target_link_libraries(sls_model PUBLIC sls::plant_keys)\n",
        "common/config/CMakeLists.txt": "add_library(sls_config STATIC a.cpp)\n"
                                        "target_link_libraries(sls_config PUBLIC\n  sls::model)\n",
        "common/models/models.cmake": "add_library(sls_${kind}_keys STATIC)\n"
                                      "target_link_libraries(sls_${kind}_keys PUBLIC sls::config)\n",
        "sim_server/plants/CMakeLists.txt": "sls_add_models(plant SOURCES a.cpp)\n",
        "recorder/CMakeLists.txt": "add_library(sls_record a.cpp)\nadd_executable(recorder main.cpp)\n"
                                   "target_link_libraries(recorder PRIVATE sls::record sls::lost)\n"})
    assert list_link_findings(tmp_path) == [
        "recorder: recorder links sls_lost", "common/model: sls_model links sls_plant_keys",
        "a circle of links: sls_config, sls_model, sls_plant_keys"]


def test_each_include_that_breaks_a_rule_is_found(tmp_path):
    write_files(tmp_path, {
        "common/model/a.hpp": '#include <Eigen/Core>\n#include "common/model/b.hpp"\n#include "common/config/c.hpp"\n',
        "common/bus/a.cpp": '#include <sls.h>\n#include "tools/doctor/a.hpp"\n',
        "common/bus/fastdds/a.hpp": '#include "common/bus/node.hpp"\n',
        "control_client/laws/mine/a.cpp": '#include "common/bus/topics.hpp"\n#include <sls.h>\n',
        "control_client/a.cpp": '#include "closed_loop/a.hpp"\n#include <Simbody.h>\n',
        "recorder/core/a.cpp": "#include <mutex>\nint a() { return Clock::now(); }\n#include <chrono>\n",
        "recorder/a.cpp": '  #  include "sim_server/a.hpp"\n',
        "sim_server/a.cpp": '#include "tests/a.hpp"\n#include <fastdds/dds/topic/Topic.hpp>\n',
        "tools/new/a.cpp": ""})
    assert list_findings(tmp_path) == [
        "common/bus/a.cpp:2: includes tools/doctor/a.hpp",
        "common/bus/fastdds/a.hpp:1: includes common/bus/node.hpp",
        "common/model/a.hpp:3: includes common/config/c.hpp",
        "control_client/a.cpp:1: includes closed_loop/a.hpp",
        "control_client/a.cpp:2: includes Simbody.h",
        "control_client/laws/mine/a.cpp:1: includes common/bus/topics.hpp",
        "control_client/laws/mine/a.cpp:2: includes sls.h",
        "recorder/a.cpp:1: includes sim_server/a.hpp",
        "recorder/core/a.cpp:1: a core must not use <mutex>",
        "recorder/core/a.cpp:2: a core must not use now()",
        "sim_server/a.cpp:1: includes tests/a.hpp",
        "sim_server/a.cpp:2: includes fastdds/dds/topic/Topic.hpp",
        "tools/new/a.cpp: no rule in tests/includes_test.py"]
