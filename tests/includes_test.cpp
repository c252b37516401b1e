// Rules for includes: which folders each folder may include, and what a core may not use. The
// folders' libraries may link those of the same folders, without a circle.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace sls {
namespace {

namespace fs = std::filesystem;

/// Files of `folder` may include files of `folder` and of `others`: folders and files of this
/// project, and external libraries. The rule of a subfolder takes precedence for its files.
struct Rule {
  std::string folder;
  std::vector<std::string> others;
};

const std::vector<Rule> kRules = {
    {"bench", {"closed_loop", "common", "control_client", "sim_server", "Wire", "Fast DDS"}},
    {"closed_loop", {"common", "control_client", "recorder", "sim_server"}},
    {"common/app", {"common/config", "common/sync", "common/text"}},
    {"common/bus",
     {"common/app", "common/config", "common/model", "common/sync", "common/text", "Wire",
      "Fast DDS"}},
    {"common/bus/fastdds",
     {"common/bus/peer.hpp", "common/bus/problems.hpp", "common/bus/spinning.hpp",
      "common/bus/topics.hpp", "common/config", "common/text", "Wire", "Fast DDS"}},
    {"common/config", {"common/model", "common/text"}},
    {"common/model", {}},
    {"common/models",
     {"common/config", "control_client/laws/laws.def", "sim_server/autopilots/autopilots.def",
      "sim_server/plants/plants.def"}},
    {"common/plugin", {"common/config", "common/model", "common/text"}},
    {"common/ros", {"common/model", "common/scene", "Fast DDS"}},
    {"common/scene", {"common/bus", "common/config", "common/model", "common/models"}},
    {"common/sync", {"common/bus/peer.hpp", "Wire"}},
    {"common/text", {}},
    {"control_client", {"common"}},
    {"control_client/core", {"common/config", "common/sync"}},
    {"control_client/laws", {"common/config", "common/model", "common/plugin"}},
    {"python", {"closed_loop", "common", "control_client", "recorder", "sim_server"}},
    {"recorder", {"common"}},
    {"recorder/core",
     {"common/bus/convert.hpp", "common/bus/names.hpp", "common/bus/peer.hpp", "common/model",
      "common/sync", "recorder/rows.hpp", "Wire"}},
    {"recorder/sinks/mcap", {"common", "recorder", "Wire", "Fast DDS"}},
    {"sim_server", {"common", "Wire"}},
    {"sim_server/autopilots", {"common/config", "common/model", "common/plugin"}},
    {"sim_server/core",
     {"common/bus/names.hpp", "common/bus/peer.hpp", "common/bus/sync_counters.hpp",
      "common/bus/topics.hpp", "common/config", "common/model", "common/sync",
      "sim_server/plants/plant.hpp", "sim_server/plants/sensing/delay_line.hpp", "Wire"}},
    {"sim_server/plants",
     {"common/config", "common/model", "common/plugin", "sim_server/autopilots", "Simbody"}},
    {"tools/convert", {"common", "recorder"}},
    {"tools/ctl", {"common"}},
    {"tools/delay_margin", {"closed_loop", "common"}},
    {"tools/doctor", {"common", "Wire", "Fast DDS"}},
    {"tools/reference", {"common/config", "common/models"}},
    {"tools/verify", {"common", "recorder"}},
    {"tools/view", {"common", "control_client/reference_trajectory.hpp", "recorder", "tools/ctl"}},
    {"worlds", {"closed_loop", "common", "control_client", "recorder", "sim_server", "Wire"}},
};

/// Folders whose files decide only: time and all that happens are arguments (CONTRIBUTING.md).
const std::vector<std::string> kCores = {"common/sync", "control_client/core", "recorder/core",
                                         "sim_server/core"};
const std::regex kNotInACore(
    R"(<(thread|mutex|atomic|condition_variable|future|csignal|signal\.h|fstream|iostream|spdlog/spdlog\.h)>)"
    R"(|\bnow\(\)|\bsleep)");

bool is_below(const std::string& path, const std::string& folder) {
  return path.rfind(folder + "/", 0) == 0;
}

/// The rule of the closest folder above the file that has one.
const Rule* find_rule(const std::string& file) {
  const Rule* found = nullptr;
  for (const Rule& rule : kRules)
    if (is_below(file, rule.folder) && (!found || found->folder.size() < rule.folder.size()))
      found = &rule;
  return found;
}

/// The library of `header` if only some folders may include it, otherwise empty.
std::string find_library(const std::string& header) {
  if (header == "sls.h" || header.rfind("slsPubSubTypes", 0) == 0) return "Wire";
  if (std::regex_search(header, std::regex("^fast(dds|rtps|cdr)[/_]"))) return "Fast DDS";
  if (std::regex_search(header, std::regex("^(Simbody|SimTK|simbody/)"))) return "Simbody";
  return "";
}

bool is_allowed(const std::string& file, const std::string& header, bool is_ours) {
  const Rule& rule = *find_rule(file);
  const std::string library = find_library(header);
  if (library.empty() && (!is_ours || is_below(header, rule.folder))) return true;
  return std::any_of(rule.others.begin(), rule.others.end(), [&](const std::string& other) {
    return library == other || header == other || is_below(header, other);
  });
}

const std::vector<std::string> kProduct = {
    "bench",  "closed_loop", "common",     "idl",   "control_client",
    "python", "recorder",    "sim_server", "tools", "worlds"};

/// `FILE:LINE: includes HEADER` for each include that breaks a rule, in the product's folders of
/// `root`.
std::vector<std::string> list_findings(const fs::path& root) {
  const std::regex include(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<std::string> findings;
  for (const std::string& top : kProduct) {
    if (!fs::exists(root / top)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string ending = entry.path().extension();
      if (ending != ".cpp" && ending != ".hpp" && ending != ".c" && ending != ".h") continue;
      const std::string file = entry.path().lexically_relative(root);
      if (!find_rule(file)) {
        findings.push_back(file + ": no rule in tests/includes_test.cpp");
        continue;
      }
      std::ifstream lines(entry.path());
      int number = 0;
      for (std::string line; std::getline(lines, line);) {
        ++number;
        const bool is_in_core = std::any_of(kCores.begin(), kCores.end(),
                                            [&](const auto& core) { return is_below(file, core); });
        if (std::smatch word; is_in_core && std::regex_search(line, word, kNotInACore))
          findings.push_back(file + ":" + std::to_string(number) + ": a core must not use " +
                             word.str());
        std::smatch found;
        if (std::regex_search(line, found, include) &&
            !is_allowed(file, found[2], found[1] == "\""))
          findings.push_back(file + ":" + std::to_string(number) + ": includes " + found[2].str());
      }
    }
  }
  std::sort(findings.begin(), findings.end());
  return findings;
}

/// A library or program: the folder of its CMakeLists.txt, and the libraries that it links.
struct Target {
  std::string folder;
  std::set<std::string> links;
};

std::string read_cmake(const fs::path& file) {
  std::ifstream stream(file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  return std::regex_replace(text, std::regex("#[^\n]*"), "");
}

/// The targets in the product's folders of `root`.
std::map<std::string, Target> read_targets(const fs::path& root) {
  const std::regex call(R"((\w+)\(\s*(\w+)(?=[\s)])([^)]*)\))"), ours(R"(\bsls(?:::|_)(\w+))");
  std::map<std::string, Target> targets;
  for (const std::string& top : kProduct) {
    if (!fs::exists(root / top)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      if (entry.path().filename() != "CMakeLists.txt") continue;
      std::string text = read_cmake(entry.path());
      if (std::smatch kind; std::regex_search(text, kind, std::regex(R"(sls_add_models\((\w+))")))
        text += std::regex_replace(read_cmake(root / "common/models/models.cmake"),
                                   std::regex(R"(\$\{kind\})"), kind.str(1));
      for (std::sregex_iterator it(text.begin(), text.end(), call), end; it != end; ++it) {
        const std::string command = (*it)[1], name = (*it)[2], arguments = (*it)[3];
        if (std::regex_match(command, std::regex("add_library|add_executable|\\w+_add_module|"
                                                 "sls_add_wire_types")))
          targets[name].folder = entry.path().parent_path().lexically_relative(root);
        if (command == "target_link_libraries")
          for (std::sregex_iterator link(arguments.begin(), arguments.end(), ours); link != end;
               ++link)
            targets[name].links.insert("sls_" + link->str(1));
      }
    }
  }
  return targets;
}

/// True if files of folder `from` may include files of folder `to`.
bool may_link(const std::string& from, const std::string& to) {
  if (from == to) return true;
  if (!find_rule(from + "/any.cpp")) return false;
  const std::string any = to == "idl" ? "sls.h" : to + "/any.hpp";
  if (is_allowed(from + "/any.cpp", any, true)) return true;
  const std::vector<std::string>& others = find_rule(from + "/any.cpp")->others;
  return std::any_of(others.begin(), others.end(), [&](const fs::path& other) {
    return other.has_extension() && other.parent_path() == to;
  });
}

/// `FOLDER: TARGET links LIBRARY` for each link that breaks a rule for includes, and each target in
/// a circle of links.
std::vector<std::string> list_link_findings(const fs::path& root) {
  std::vector<std::string> findings;
  std::map<std::string, Target> targets = read_targets(root);
  for (const auto& [name, target] : targets)
    for (const std::string& link : target.links)
      if (targets.count(link) == 0 || !may_link(target.folder, targets[link].folder))
        findings.push_back(target.folder + ": " + name + " links " + link);
  // Removes, again and again, the targets that link none of the rest or are linked by none.
  const auto is_free = [&](const auto& item) {
    const auto links = [](const Target& from, const std::string& to) {
      return from.links.count(to) > 0;
    };
    return std::none_of(targets.begin(), targets.end(),
                        [&](const auto& other) { return links(item.second, other.first); }) ||
           std::none_of(targets.begin(), targets.end(),
                        [&](const auto& other) { return links(other.second, item.first); });
  };
  const auto find_free = [&] { return std::find_if(targets.begin(), targets.end(), is_free); };
  for (auto free = find_free(); free != targets.end(); free = find_free()) targets.erase(free);
  for (const auto& [name, target] : targets)
    findings.push_back(target.folder + ": " + name + " is in a circle of links");
  return findings;
}

TEST(IncludesTest, NoLibraryLinksUpwardsOrInACircle) {
  EXPECT_EQ(list_link_findings(SLS_SOURCE_DIR), std::vector<std::string>());
  EXPECT_GT(read_targets(SLS_SOURCE_DIR).size(), 40u);
}

TEST(IncludesTest, NoFileIncludesUpwards) {
  EXPECT_EQ(list_findings(SLS_SOURCE_DIR), std::vector<std::string>());
}

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(IncludesTest, FindsEachLinkThatBreaksARule) {
  const test::TemporaryFolder folder;
  const auto write_cmake = [&](const std::string& of, const std::string& text) {
    write(folder.path() / of / "CMakeLists.txt", text);
  };
  write_cmake("common/model",
              "add_library(sls_model STATIC a.cpp)\n# sls::config\n"
              "target_link_libraries(sls_model PUBLIC sls::plant_keys)\n");
  write_cmake("common/config",
              "add_library(sls_config STATIC a.cpp)\n"
              "target_link_libraries(sls_config PUBLIC\n  sls::model)\n");
  write(folder.path() / "common/models/models.cmake",
        "add_library(sls_${kind}_keys STATIC)\n"
        "target_link_libraries(sls_${kind}_keys PUBLIC sls::config)\n");
  write_cmake("sim_server/plants", "sls_add_models(plant SOURCES a.cpp)\n");
  write_cmake("recorder",
              "add_library(sls_record a.cpp)\nadd_executable(recorder main.cpp)\n"
              "target_link_libraries(recorder PRIVATE sls::record sls::lost)\n");
  EXPECT_EQ(list_link_findings(folder.path()),
            (std::vector<std::string>{
                "recorder: recorder links sls_lost", "common/model: sls_model links sls_plant_keys",
                "common/config: sls_config is in a circle of links",
                "common/model: sls_model is in a circle of links",
                "sim_server/plants: sls_plant_keys is in a circle of links"}));
}

TEST(IncludesTest, FindsEachIncludeThatBreaksARule) {
  const test::TemporaryFolder folder;
  const auto write = [&](const std::string& file, const std::string& text) {
    sls::write(folder.path() / file, text);
  };
  write("common/model/a.hpp",
        "#include <Eigen/Core>\n#include \"common/model/b.hpp\"\n"
        "#include \"common/config/c.hpp\"\n");
  write("common/bus/a.cpp", "#include <sls.h>\n#include \"tools/doctor/a.hpp\"\n");
  write("common/bus/fastdds/a.hpp", "#include \"common/bus/node.hpp\"\n");
  write("control_client/laws/mine/a.cpp", "#include \"common/bus/topics.hpp\"\n#include <sls.h>\n");
  write("control_client/a.cpp", "#include \"closed_loop/a.hpp\"\n#include <Simbody.h>\n");
  write("recorder/core/a.cpp",
        "#include <mutex>\nint a() { return Clock::now(); }\n#include <chrono>\n");
  write("recorder/a.cpp", "  #  include \"sim_server/a.hpp\"\n");
  write("sim_server/a.cpp", "#include \"tests/a.hpp\"\n#include <fastdds/dds/topic/Topic.hpp>\n");
  write("tools/new/a.cpp", "");
  EXPECT_EQ(
      list_findings(folder.path()),
      (std::vector<std::string>{"common/bus/a.cpp:2: includes tools/doctor/a.hpp",
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
                                "tools/new/a.cpp: no rule in tests/includes_test.cpp"}));
}

}  // namespace
}  // namespace sls
