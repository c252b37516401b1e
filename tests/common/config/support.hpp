/// Shared by several tests of the configuration.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "control_client/laws/qsf/keys.hpp"
#include "sim_server/plants/slung_load/keys.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"

namespace sls::config::test {

using control::NamedGains;
using control::QsfKeys;
using sls::test::read_bytes;
using sls::test::replace_once;

/// Equal in every key.
inline bool are_equal(const Scenario& a, const Scenario& b) { return to_yaml(a) == to_yaml(b); }

/// The message of the ConfigError that `text` (in "file") gives, or "no error".
std::string find_error(const std::string& text);

/// The YAML files of `folder`, a path from the root of the repository, by name.
std::vector<std::filesystem::path> list_yaml_files(const std::string& folder);

/// Every key of the plant `slung_load`, then of `multirotor` with the autopilot `px4`, each with a
/// value that is not its default.
extern const char* const kEveryKey;
extern const char* const kEveryMultirotorKey;

/// Reads `text`, writes it and reads that: reader and writer must know each key of it, and give
/// `expected`.
void expect_every_key(const std::string& text, const Scenario& expected);

/// A short valid scenario, one key per line, in which tests replace parts.
extern const char* const kMinimalScenario;
/// The same of a multirotor with the section `autopilot`.
std::string make_autopilot_text(const std::string& autopilot);

}  // namespace sls::config::test
