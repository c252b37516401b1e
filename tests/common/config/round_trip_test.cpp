// Properties over many scenarios, with fixed seeds: a failure is reproducible.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <regex>
#include <set>

#include "common/config/scenario_writer.hpp"
#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

/// A random number as the writer writes it: whole, with few digits, or with all digits and of any
/// size, which no time has: it is a whole number of nanoseconds.
std::string make_number(std::mt19937_64& random, bool is_time) {
  switch (random() % (is_time ? 2 : 4)) {
    case 0:
      return to_yaml_value(static_cast<int>(random() % 100));
    case 1:
      return to_yaml_value(static_cast<double>(random() % 10'000) / 1000.0);
    default:
      const double size = std::pow(10.0, static_cast<int>(random() % 13) - 6);
      return to_yaml_value(std::uniform_real_distribution<double>(-3.0, 10.0)(random) * size);
  }
}

TEST(RoundTripTest, EachNumberOfAWrittenScenarioIsReadAndWritten) {
  std::vector<std::string> texts{kEveryKey, kEveryMultirotorKey};
  for (const auto& file : list_yaml_files("config/scenarios")) texts.push_back(read_bytes(file));
  std::mt19937_64 random(20240607);
  const std::regex number(R"([ \[](-?[0-9][0-9.e-]*)(?=[,\]\n]))");
  std::set<std::string> accepted;  // keys
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string written = to_yaml(parse_scenario(texts[i], "file"));
    for (std::sregex_iterator at(written.begin(), written.end(), number), end; at != end; ++at) {
      const auto place = static_cast<std::size_t>(at->position(1));
      const auto line = written.find_first_not_of(" -", written.rfind('\n', place) + 1);
      const std::string key = written.substr(line, written.find(':', line) - line);
      if (key == "attitude") continue;                  // is made a unit quaternion
      if (i >= 2 && accepted.count(key) > 0) continue;  // was tried
      const bool is_time = key.size() > 2 && key.substr(key.size() - 2) == "_s" &&
                           key.find("m_s") == key.npos && key.find("rad_s") == key.npos;
      for (int tries = i < 2 ? 4 : 1; tries > 0; --tries) {
        std::string changed = written;
        changed.replace(place, static_cast<std::size_t>(at->length(1)),
                        make_number(random, is_time));
        try {
          ASSERT_EQ(to_yaml(parse_scenario(changed, "file")), changed);
          accepted.insert(key);
        } catch (const ConfigError&) {  // not a valid value of this key
        }
      }
    }
  }
  EXPECT_GT(accepted.size(), 90u);
}

TEST(RoundTripTest, NamesOfAllPrintableCharactersAreReadAsWritten) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 200; ++i) {
    std::string name;
    for (auto left = 1 + random() % 32; left > 0; --left)
      name += static_cast<char>(' ' + random() % 95);
    Scenario scenario = parse_scenario(kMinimalScenario, "file");
    scenario.mission[0].name = name;
    EXPECT_EQ(parse_scenario(to_yaml(scenario), "file").mission[0].name, name);
  }
}

TEST(RoundTripTest, ShippedScenariosWrittenAndReadAreEqual) {
  for (const auto& file : list_yaml_files("config/scenarios")) {
    const Scenario scenario = load_scenario(file);
    EXPECT_TRUE(are_equal(parse_scenario(to_yaml(scenario), "file"), scenario)) << file;
  }
}

TEST(RoundTripTest, ALoadOnEqualCablesNeedsNoListOfThem) {
  std::string text = read_bytes(std::string(SLS_SOURCE_DIR) + "/config/scenarios/slack_drop.yaml");
  const std::size_t from = text.find("  cables: [");
  text.erase(from, text.find('\n', from) - from);
  const Scenario scenario = parse_scenario(text, "file");
  EXPECT_TRUE(are_equal(parse_scenario(to_yaml(scenario), "file"), scenario)) << to_yaml(scenario);
}

/// Changes `text` at one random place: sets or removes bytes, inserts or copies a piece, or cuts
/// the rest off.
void mutate(std::string& text, std::mt19937_64& random) {
  static const std::vector<std::string> kPieces = {
      "- ", "? ", ": ", "{",  "}",  "[",  "]",   "&a ",   "*a",       "!!",          "|\n", "'",
      "\"", "#",  "\t", "\n", "\r", "\\", "---", "...\n", "<<: ",     "%TAG",        "~",   ".nan",
      "-",  "0",  "1e", "e9", ".",  ",",  "  ",  "\xff",  "\xc2\x85", "\xef\xbb\xbf"};
  const auto below = [&](std::size_t size) { return size == 0 ? 0 : random() % size; };
  const std::size_t at = below(text.size());
  switch (random() % 6) {
    case 0:
      if (!text.empty()) text[at] = static_cast<char>(random() % 256);
      break;
    case 1:
      text.erase(at, 1 + below(8));
      break;
    case 2:
      text.insert(at, text.substr(below(text.size()), below(40)));
      break;
    case 3:
      if (random() % 8 == 0) text.resize(at);
      break;
    default:
      text.insert(at, kPieces[below(kPieces.size())]);
  }
}

TEST(MutationTest, SpoiltScenariosGiveAScenarioOrOneLineOfError) {
  std::vector<std::string> texts;
  for (const auto& file : list_yaml_files("config/scenarios")) texts.push_back(read_bytes(file));
  ASSERT_FALSE(texts.empty());

  std::mt19937_64 random(4);
  int refused = 0, accepted = 0;
  for (int i = 0; i < 6000; ++i) {
    std::string text = texts[random() % texts.size()];
    for (auto left = 1 + random() % 4; left > 0; --left) mutate(text, random);
    try {
      const Scenario scenario = parse_scenario(text, "file");
      ASSERT_TRUE(are_equal(parse_scenario(to_yaml(scenario), "file"), scenario)) << text;
      ++accepted;
    } catch (const ConfigError& error) {
      const std::string message = error.what();
      ASSERT_EQ(message.rfind("file:", 0), 0u) << message;
      for (const char c : message) ASSERT_TRUE(c >= ' ' && c <= '~') << message << '\n' << text;
      ++refused;
    }
  }
  // Both outcomes must occur.
  EXPECT_GT(accepted, 100);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace sls::config::test
