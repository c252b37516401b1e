// The file of faults: what it holds, and one line for each mistake.
#include "common/config/faults.hpp"

#include <gtest/gtest.h>

#include "tests/common/config/support.hpp"
#include "tests/support/errors.hpp"

namespace sls::config::faults {
namespace {

const Abilities kTool{"tool",
                      {"link.loss", "link.delay_ms", "kill", "stop", "cut", "loss", "request",
                       "disk-full", "step", "until_s"},
                      {}};

std::string find_error(const std::string& text, const Abilities& abilities = kTool) {
  return sls::test::find_error<ConfigError>([&] { parse(text, "file", abilities); });
}
/// The error of one fault, on line 2.
std::string find_error_of(const std::string& fault, const Abilities& abilities = kTool) {
  return find_error("faults:\n  - " + fault + "\n", abilities);
}

TEST(FaultsTest, AFileHoldsOneCaseOrAListOfThem) {
  const auto single = parse(
      "link: { loss: 0.2, delay_ms: [1, 3] }\n"
      "faults: [{ kind: cut, from: server, to: controller-2, at_s: 0.5, for_s: 2 }]\n"
      "until_s: 9\n",
      "file", kTool);
  ASSERT_EQ(single.size(), 1u);
  EXPECT_EQ(single[0].link.loss->most, 0.2);
  EXPECT_EQ(single[0].link.delay_ms->least, 1);
  EXPECT_EQ(single[0].link.delay_ms->most, 3);
  EXPECT_FALSE(single[0].link.jitter_ms);
  EXPECT_EQ(single[0].until_s->least, 9);
  const Fault& fault = single[0].faults.at(0);
  EXPECT_EQ(fault.kind, Kind::kCut);
  EXPECT_EQ(fault.program.role, Role::kServer);
  EXPECT_EQ(fault.to.number, 2);
  EXPECT_FALSE(fault.is_at_step);
  EXPECT_EQ(fault.at.least, 0.5);
  EXPECT_EQ(fault.for_s.most, 2);
  EXPECT_EQ(fault.place, "file:2: faults[0]");

  const auto two =
      parse("cases:\n  - { name: good }\n  - { name: bad, link: { loss: 0.2 } }\n", "file", kTool);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[1].name, "bad");
}

TEST(FaultsTest, AFaultReadsBackFromItsLine) {
  for (const std::string line :
       {"{ kind: kill, program: controller-2, restart_s: [0.5, 2], step: 300 }",
        "{ kind: stop, program: recorder, for_s: 2.25, at_s: [0, 1] }",
        "{ kind: loss, loss: 0.9, for_s: 1, at_s: 0 }",
        "{ kind: request, program: server, action: step, steps: 3, at_s: 0 }"})
    EXPECT_EQ(to_line(parse("faults: [" + line + "]", "file", kTool).at(0).faults.at(0)), line);
}

TEST(FaultsTest, EachMistakeGivesItsLine) {
  EXPECT_EQ(find_error("link: { los: 0.1 }"),
            "file:1: link.los: unknown key; did you mean 'loss'?");
  EXPECT_EQ(find_error("until_s: 3"),
            "file:1: expected exactly one of cases, link+faults, got none");
  EXPECT_EQ(find_error("link: {}\ncases: [{}]"),
            "file:1: expected exactly one of cases, link+faults, got cases and link");
  EXPECT_EQ(find_error("cases: []"),
            "file:1: cases: expected a list of 1 to 1000 cases, got a "
            "list of 0");
  EXPECT_EQ(find_error("link: { loss: 0.95 }"),
            "file:1: link.loss: expected from 0 to 0.9, got 0.95");
  EXPECT_EQ(find_error("link: { delay_ms: [3, 1] }"),
            "file:1: link.delay_ms: expected a range [least, most], got [3, 1]");
  EXPECT_EQ(find_error("link: { delay_ms: [1, 2, 3] }"),
            "file:1: link.delay_ms: expected a number or a range [least, most], got a list of 3");
  EXPECT_EQ(find_error("link: { delay_ms: [-1, 2] }"),
            "file:1: link.delay_ms[0]: expected from 0 to 1000 ms, got -1");
  EXPECT_EQ(
      find_error_of("{ kind: explode, at_s: 1 }"),
      "file:2: faults[0].kind: expected kill or power-cut or stop or interrupt or cut or "
      "isolate or loss or slow or clock or disk-full or request or partition or clog or stall or "
      "refuse or block, got explode");
  EXPECT_EQ(find_error_of("{ kind: kill, program: vehicle, at_s: 1 }"),
            "file:2: faults[0].program: expected server, controller or recorder, with a number "
            "where there are several (controller-2), got vehicle");
  EXPECT_EQ(find_error_of("{ kind: disk-full, program: server, at_s: 1, for_s: 1 }"),
            "file:2: faults[0].program: expected recorder, with a number where there are several "
            "(recorder-2), got server");
  EXPECT_EQ(find_error_of("{ kind: kill, program: server, at_s: 1, step: 3 }"),
            "file:2: faults[0]: expected exactly one of at_s, step, got at_s and step");
  EXPECT_EQ(find_error_of("{ kind: kill, program: server }"),
            "file:2: faults[0]: expected exactly one of at_s, step, got none");
  EXPECT_EQ(find_error_of("{ kind: kill, program: server, at_s: -1 }"),
            "file:2: faults[0].at_s: expected from 0 to 10000 s, got -1");
  EXPECT_EQ(find_error_of("{ kind: stop, program: server, at_s: 1, for_s: -2 }"),
            "file:2: faults[0].for_s: expected from 0 to 10000 s, got -2");
  EXPECT_EQ(find_error_of("{ kind: kill, program: server, step: 1.5 }"),
            "file:2: faults[0].step: expected a whole number from 0 to 1000000000, got 1.5");
  EXPECT_EQ(find_error_of("{ kind: stop, program: server, at_s: 1 }"),
            "file:2: faults[0].for_s: missing key; expected a number or a range [least, most]");
  EXPECT_EQ(find_error_of("{ kind: kill, program: server, at_s: 1, for_s: 1 }"),
            "file:2: faults[0].for_s: unknown key; expected one of kind, program, restart_s, at_s, "
            "step");
}

TEST(FaultsTest, AWordThatAToolDoesNotKnowIsRefused) {
  const Abilities few{"chaos", {"kill", "link.loss"}, {"server-1", "recorder-1"}};
  EXPECT_EQ(find_error("link: { mtu_bytes: 576 }", few),
            "file:1: link.mtu_bytes: expected what chaos can do (kill, link.loss), got "
            "link.mtu_bytes");
  EXPECT_EQ(find_error_of("{ kind: clock, program: server, at_s: 1, jump_s: 3 }", few),
            "file:2: faults[0].kind: expected what chaos can do (kill, link.loss), got clock");
  EXPECT_EQ(find_error_of("{ kind: kill, program: server, step: 1 }", few),
            "file:2: faults[0].step: expected what chaos can do (kill, link.loss), got step");
  EXPECT_EQ(find_error_of("{ kind: kill, program: controller-2, at_s: 1 }", few),
            "file:2: faults[0].program: expected what chaos can do (recorder-1, server-1), got "
            "controller-2");
}

TEST(FaultsTest, AMissingFileIsNamed) {
  EXPECT_EQ(sls::test::find_error<ConfigError>([] { load("no_such.yaml", kTool); }),
            "no_such.yaml: expected a file of faults, got none (No such file or directory)");
}

TEST(FaultsTest, ThePageNamesEveryWord) {
  const std::string page = sls::test::read_bytes(SLS_SOURCE_DIR "/docs/faults.md");
  const auto expect_named = [&](const std::string& word) {
    EXPECT_NE(page.find('`' + word + '`'), std::string::npos) << word;
  };
  EXPECT_GT(list_keys().size(), 25u);
  for (const ListedKey& key : list_keys()) expect_named(key.path.substr(key.path.rfind('.') + 1));
  for (const auto& kind : names_of(Kind{})) expect_named(kind.text);
  for (const auto& action : names_of(Action{})) expect_named(action.text);
}

}  // namespace
}  // namespace sls::config::faults
