// Rules for includes: which folders each folder may include, and what a core may not use.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
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
    {"bench",
     {"closed_loop", "common", "control_client", "recorder", "sim_server", "Wire", "Fast DDS"}},
    {"closed_loop", {"common", "control_client", "recorder", "sim_server"}},
    {"common/app", {"common/config", "common/sync"}},
    {"common/bus",
     {"common/app", "common/config", "common/model", "common/sync", "Wire", "Fast DDS"}},
    {"common/bus/fastdds",
     {"common/bus/peer.hpp", "common/bus/problems.hpp", "common/bus/spinning.hpp",
      "common/bus/topics.hpp", "common/config", "Wire", "Fast DDS"}},
    {"common/config", {"common/model"}},
    {"common/model", {}},
    {"common/models",
     {"common/config", "control_client/laws/laws.def", "sim_server/autopilots/autopilots.def",
      "sim_server/plants/plants.def"}},
    {"common/plugin", {"common/config", "common/model"}},
    {"common/ros", {"common/model", "Fast DDS"}},
    {"common/sync", {"common/bus/peer.hpp", "Wire"}},
    {"control_client", {"common"}},
    {"control_client/core", {"common/config", "common/sync"}},
    {"control_client/laws", {"common/config", "common/model", "common/plugin"}},
    {"python", {"closed_loop", "common", "control_client", "recorder", "sim_server"}},
    {"recorder", {"common"}},
    {"recorder/core", {"common/sync"}},
    {"recorder/sinks/mcap", {"common", "recorder", "Wire", "Fast DDS"}},
    {"sim_server", {"common", "Wire"}},
    {"sim_server/autopilots", {"common/config", "common/model", "common/plugin"}},
    {"sim_server/core",
     {"common/bus/convert.hpp", "common/bus/names.hpp", "common/bus/peer.hpp", "common/config",
      "common/model", "common/sync", "Wire"}},
    {"sim_server/plants",
     {"common/config", "common/model", "common/plugin", "sim_server/autopilots", "Simbody"}},
    {"tools/convert", {"common", "recorder"}},
    {"tools/ctl", {"common"}},
    {"tools/delay_margin", {"closed_loop", "common"}},
    {"tools/doctor", {"common", "Wire", "Fast DDS"}},
    {"tools/reference", {"common/config", "common/models"}},
    {"tools/verify", {"common", "recorder"}},
    {"tools/view",
     {"common", "control_client/reference_trajectory.hpp", "recorder",
      "sim_server/plants/multirotor/keys.hpp", "tools/ctl"}},
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

/// `FILE:LINE: includes HEADER` for each include that breaks a rule, in the product's folders of
/// `root`.
std::vector<std::string> find_faults(const fs::path& root) {
  const std::regex include(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<std::string> faults;
  for (const char* top : {"bench", "closed_loop", "common", "control_client", "python", "recorder",
                          "sim_server", "tools"}) {
    if (!fs::exists(root / top)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string ending = entry.path().extension();
      if (ending != ".cpp" && ending != ".hpp" && ending != ".c" && ending != ".h") continue;
      const std::string file = entry.path().lexically_relative(root);
      if (!find_rule(file)) {
        faults.push_back(file + ": no rule in tests/includes_test.cpp");
        continue;
      }
      std::ifstream lines(entry.path());
      int number = 0;
      for (std::string line; std::getline(lines, line);) {
        ++number;
        const bool is_in_core = std::any_of(kCores.begin(), kCores.end(),
                                            [&](const auto& core) { return is_below(file, core); });
        if (std::smatch word; is_in_core && std::regex_search(line, word, kNotInACore))
          faults.push_back(file + ":" + std::to_string(number) + ": a core must not use " +
                           word.str());
        std::smatch found;
        if (std::regex_search(line, found, include) &&
            !is_allowed(file, found[2], found[1] == "\""))
          faults.push_back(file + ":" + std::to_string(number) + ": includes " + found[2].str());
      }
    }
  }
  std::sort(faults.begin(), faults.end());
  return faults;
}

TEST(IncludesTest, NoFileIncludesUpwards) {
  EXPECT_EQ(find_faults(SLS_SOURCE_DIR), std::vector<std::string>());
}

TEST(IncludesTest, FindsEachIncludeThatBreaksARule) {
  const test::TemporaryFolder folder;
  const auto write = [&](const std::string& file, const std::string& text) {
    fs::create_directories((folder.path() / file).parent_path());
    std::ofstream(folder.path() / file) << text;
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
      find_faults(folder.path()),
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
