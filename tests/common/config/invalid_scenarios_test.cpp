// Every mistake gives one line with place, key, expected and found value.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <regex>

#include "tests/common/config/support.hpp"
#include "tests/support/edited_documents.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::config::test {
namespace {

namespace fs = std::filesystem;

/// The message of the ConfigError that loading `file` gives, or "no error".
std::string find_load_error(const fs::path& file) {
  return sls::test::find_error<ConfigError>([&] { load_scenario(file); });
}

class UnusableFileTest : public testing::Test {
 protected:
  fs::path write(const std::string& text) const {
    const fs::path file = folder_ / "scenario.yaml";
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

  const sls::test::TemporaryFolder own_folder_;
  const fs::path folder_ = own_folder_.path();
};

TEST(InvalidScenariosTest, EachRowOfTheTableGivesItsMessage) {
  const auto rows =
      sls::test::read_edited_documents(SLS_SOURCE_DIR "/tests/common/config/invalid_scenarios.txt");
  EXPECT_GT(rows.size(), 380u);
  for (const auto& [place, text, message] : rows)
    EXPECT_EQ(find_error(text), "file:" + message) << place;
}

TEST_F(UnusableFileTest, MissingFile) {
  const fs::path file = folder_ / "nothing.yaml";
  EXPECT_EQ(find_load_error(file),
            file.string() + ": expected a scenario file, got none (No such file or directory)");
}

TEST_F(UnusableFileTest, DirectoryInsteadOfFile) {
  EXPECT_EQ(find_load_error(folder_),
            folder_.string() + ": expected a scenario file, got a directory");
}

TEST_F(UnusableFileTest, PipeInsteadOfFile) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(find_load_error(pipe),
            pipe.string() + ": expected a scenario file, got a pipe, socket or device");
}

TEST_F(UnusableFileTest, EmptyFile) {
  const fs::path file = write("");
  EXPECT_EQ(find_load_error(file), file.string() + ": expected a scenario file, got an empty file");
}

TEST_F(UnusableFileTest, HundredMegabytes) {
  const fs::path file = write(kMinimalScenario);
  fs::resize_file(file, 100'000'000);
  EXPECT_EQ(find_load_error(file), file.string() + ": expected at most 32768 bytes, got 100000000");
}

TEST_F(UnusableFileTest, OneByteTooManyAndTheLongestThatFits) {
  const std::string comment(kMaxScenarioBytes - std::string(kMinimalScenario).size(), '#');
  EXPECT_EQ(find_load_error(write(kMinimalScenario + comment)), "no error");
  const fs::path file = write(kMinimalScenario + comment + "#");
  EXPECT_EQ(find_load_error(file), file.string() + ": expected at most 32768 bytes, got 32769");
}

TEST_F(UnusableFileTest, UnreadableFile) {
  const fs::path file = write(kMinimalScenario);
  ASSERT_EQ(chmod(file.c_str(), 0), 0);
  ASSERT_EQ(chmod(folder_.c_str(), 0755), 0);
  const bool is_root = geteuid() == 0;
  constexpr uid_t kNobody = 65534;  // root can read every file
  if (is_root) {
    ASSERT_EQ(seteuid(kNobody), 0);
  }
  const std::string message = find_load_error(file);
  if (is_root) {
    ASSERT_EQ(seteuid(0), 0);
  }
  EXPECT_EQ(
      message,
      file.string() + ": expected a scenario file, got none that can be read (Permission denied)");
}

TEST(InvalidTextTest, NamesTheSenderWhereTextCameOverTheWire) {
  const std::string text(kMaxScenarioBytes + 1, '#');
  EXPECT_EQ(find_error(text), "file: expected at most 32768 bytes, got 32769");
  EXPECT_EQ(find_error(""), "file:1: expected a map, got nothing");
}

TEST(InvalidTextTest, EachNumberOfAGroupIsRefusedWithItsLineIfItIsNone) {
  const std::regex number(R"([ \[](-?[0-9][0-9.e-]*)(?=[,\] }\n]))");
  std::size_t judged = 0;
  for (const std::string name : {"rotors_carry_a_triangle", "two_carry_a_bar", "winch_down",
                                 "lift_and_set_down", "cable_cut"}) {
    std::string text = read_bytes(SLS_SOURCE_DIR "/config/scenarios/" + name + ".yaml");
    if (name == "rotors_carry_a_triangle")
      text = replace_once(text, "model: cables\n",
                          "model: cables\n  restitution: 0.5\n  load_rates_rad_s: [0, 0, 1]\n"
                          "  load_inertia_products_kg_m2: [0, 0, 0]\n"
                          "  inertia_products_kg_m2: [0, 0, 0]\n"
                          "  disturbance_torque_n_m: [0, 0, 0]\n");
    EXPECT_EQ(find_error(text), "no error");
    for (std::sregex_iterator at(text.begin(), text.end(), number), end; at != end; ++at) {
      const auto place = static_cast<std::size_t>(at->position(1));
      if (text[text.rfind('\n', place) + 1] == '#') continue;
      std::string broken = text;
      broken.replace(place, static_cast<std::size_t>(at->length(1)), ".nan");
      const std::string error = find_error(broken);
      const auto line = 1 + std::count(text.begin(), text.begin() + at->position(1), '\n');
      EXPECT_EQ(error.rfind("file:" + std::to_string(line) + ": ", 0), 0u) << error;
      EXPECT_NE(error.find(", got .nan"), std::string::npos) << error;
      ++judged;
    }
  }
  EXPECT_GT(judged, 150u);
}

TEST(InvalidTextTest, LineIsRightWithCarriageReturns) {
  std::string text = replace_once(kMinimalScenario, "0.2", "-0.2");
  for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += 2) text.insert(at, "\r");
  EXPECT_EQ(find_error(text), "file:4: vehicle.load_mass_kg: expected > 0, got -0.2");
}

TEST(InvalidTextTest, MoreThanThousandStagesAreRefused) {
  std::string text = kMinimalScenario;
  text.resize(text.find("mission:"));
  text += "mission: [";
  for (int i = 0; i <= 1000; ++i) text += "{},";
  EXPECT_EQ(find_error(text + "]"),
            "file:9: mission: expected a list of 1 to 1000 stages, got a list of 1001");
}

TEST(InvalidTextTest, MoreThanThousandFaultsAreRefused) {
  std::string text = std::string(kMinimalScenario) + "faults: [";
  for (int i = 0; i <= 1000; ++i) text += "{},";
  EXPECT_EQ(find_error(text + "]"),
            "file:12: faults: expected a list of 0 to 1000 faults, got a list of 1001");
}

TEST(InvalidTextTest, EndlessNestingEndsInAnErrorAndNotInAnOverflow) {
  for (const std::string opening :
       {"[", "{", "- ", "? ", "{a: ", "[{", "&a [", "!a [", "'", "\""}) {
    std::string text;
    while (text.size() + opening.size() <= kMaxScenarioBytes) text += opening;
    EXPECT_EQ(find_error(text).rfind("file:", 0), 0u) << opening;
  }
}

}  // namespace
}  // namespace sls::config::test
