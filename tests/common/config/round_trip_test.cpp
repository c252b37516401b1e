// Properties over many scenarios, with fixed seeds: a failure is reproducible.
#include <gtest/gtest.h>

#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

TEST(RoundTripTest, RandomScenariosWrittenAndReadAreEqual) {
  std::mt19937_64 random(20240607);
  for (int i = 0; i < 1000; ++i) {
    const Scenario written = make_random_scenario(random);
    const std::string text = to_yaml(written);
    Scenario read;
    ASSERT_NO_THROW(read = parse_scenario(text, "file")) << text;
    ASSERT_TRUE(are_equal(written, read)) << text;
    ASSERT_EQ(to_yaml(read), text);
  }
}

TEST(RoundTripTest, ShippedScenariosWrittenAndReadAreEqual) {
  for (const auto& file : list_yaml_files("config/scenarios")) {
    const Scenario scenario = load_scenario(file);
    EXPECT_TRUE(are_equal(parse_scenario(to_yaml(scenario), "file"), scenario)) << file;
  }
}

TEST(RoundTripTest, ALoadOnEqualCablesNeedsNoListOfThem) {
  std::string text = read_text(std::string(SLS_SOURCE_DIR) + "/config/scenarios/slack_drop.yaml");
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
  for (const auto& file : list_yaml_files("config/scenarios")) texts.push_back(read_text(file));
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
