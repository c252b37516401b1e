#include "common/config/faults.hpp"

#include <cmath>
#include <string_view>

#include "common/config/numbers.hpp"
#include "common/config/scenario_reader.hpp"

namespace sls::config::faults {

constexpr NumberRule kTime{"from 0 to 10000 s", [](double x) { return x >= 0 && x <= 1e4; }};
constexpr NumberRule kDelay{"from 0 to 1000 ms", [](double x) { return x >= 0 && x <= 1e3; }};
constexpr NumberRule kLoss{"from 0 to 0.9", [](double x) { return x >= 0 && x <= 0.9; }};
constexpr NumberRule kBandwidth{"Mbit/s from 0.1 to 10000",
                                [](double x) { return x >= 0.1 && x <= 1e4; }};
constexpr NumberRule kBytes{"a whole number of bytes from 576 to 9000",
                            [](double x) { return x >= 576 && x <= 9000 && x == std::floor(x); }};
constexpr NumberRule kStep{"a whole number from 0 to 1000000000",
                           [](double x) { return x >= 0 && x <= 1e9 && x == std::floor(x); }};
constexpr NumberRule kSteps{"a whole number from 1 to 1000000",
                            [](double x) { return x >= 1 && x <= 1e6 && x == std::floor(x); }};
constexpr NumberRule kSlowness{"from 0 to 1 s", [](double x) { return x >= 0 && x <= 1; }};
constexpr NumberRule kJump{"from -3600 to 3600 s", [](double x) { return std::abs(x) <= 3600; }};
constexpr ListRange kCases{1, 1000, "cases"};
constexpr ListRange kFaultList{0, 1000, "faults"};

constexpr const char* kRoles[] = {"server", "controller", "recorder"};

/// The program of this name: of a role, and a number from 1 to 9 where there are several.
static std::optional<Program> find_program(std::string_view text) {
  for (const Role role : {Role::kServer, Role::kController, Role::kRecorder}) {
    const std::string_view name = kRoles[static_cast<int>(role)];
    if (text.substr(0, name.size()) != name) continue;
    const std::string_view rest = text.substr(name.size());
    if (rest.empty()) return Program{role, 1};
    if (rest.size() == 2 && rest[0] == '-' && rest[1] >= '1' && rest[1] <= '9')
      return Program{role, rest[1] - '0'};
  }
  return std::nullopt;
}
template <Role kRole>
bool is_of(std::string_view text) {
  const auto found = find_program(text);
  return found && found->role == kRole;
}
constexpr TextRule kProgram{
    "server, controller or recorder, with a number where there are several (controller-2)",
    [](std::string_view text) { return find_program(text).has_value(); }};
constexpr TextRule kServer{"server, with a number where there are several (server-2)",
                           &is_of<Role::kServer>};
constexpr TextRule kRecorder{"recorder, with a number where there are several (recorder-2)",
                             &is_of<Role::kRecorder>};

std::string to_yaml_value(const Program& program) {
  const std::string name = kRoles[static_cast<int>(program.role)];
  return program.number == 1 ? name : name + "-" + std::to_string(program.number);
}

std::string to_yaml_value(const Span& span) {
  return span.least == span.most ? to_text(span.least)
                                 : "[" + to_text(span.least) + ", " + to_text(span.most) + "]";
}

static void read_value(const Value& value, Span& span, const NumberRule& rule) {
  if (value.node.kind != YamlNode::Kind::kList) {
    config::read_value(value, span.least, rule);
    span.most = span.least;
    return;
  }
  if (value.node.items.size() != 2) value.fail_expecting("a number or a range [least, most]");
  config::read_value(value.at(0), span.least, rule);
  config::read_value(value.at(1), span.most, rule);
  if (span.least > span.most)
    value.fail("expected a range [least, most], got " + to_yaml_value(span));
}

static void read_value(const Value& value, Program& program, const TextRule& rule) {
  if (!rule.holds(value.node.text)) value.fail_expecting(rule.expectation);
  program = *find_program(value.node.text);
}

static std::string to_expectation(const Span&) { return "a number or a range [least, most]"; }
static std::string to_expectation(const Program&) { return kProgram.expectation; }

template <class Map>
void describe(Map& map, Link& link) {
  map.key(kOptional, "delay_ms", link.delay_ms, kDelay);
  map.key(kOptional, "jitter_ms", link.jitter_ms, kDelay);
  map.key(kOptional, "loss", link.loss, kLoss);
  map.key(kOptional, "reordering", link.reordering, kProbability);
  map.key(kOptional, "reordering_ms", link.reordering_ms, kDelay);
  map.key(kOptional, "duplicates", link.duplicates, kProbability);
  map.key(kOptional, "bandwidth_mbit", link.bandwidth_mbit, kBandwidth);
  map.key(kOptional, "mtu_bytes", link.mtu_bytes, kBytes);
  map.key(kOptional, "multicast", link.has_multicast);
}

template <class Map>
void describe_effect(Map& map, Fault& fault, Kind kind) {
  const auto lasts = [&] { map.key(kRequired, "for_s", fault.for_s, kTime); };
  switch (kind) {
    case Kind::kKill:
    case Kind::kPowerCut:
      map.key(kRequired, "program", fault.program, kProgram);
      map.key(kOptional, "restart_s", fault.restart_s, kTime);
      return;
    case Kind::kInterrupt:
      return map.key(kRequired, "program", fault.program, kProgram);
    case Kind::kStop:
    case Kind::kIsolate:
      map.key(kRequired, "program", fault.program, kProgram);
      return lasts();
    case Kind::kCut:
      map.key(kRequired, "from", fault.program, kProgram);
      map.key(kRequired, "to", fault.to, kProgram);
      return lasts();
    case Kind::kLoss:
      map.key(kRequired, "loss", fault.value, kLoss);
      return lasts();
    case Kind::kSlow:
      map.key(kRequired, "program", fault.program, kProgram);
      map.key(kRequired, "late_s", fault.value, kSlowness);
      return lasts();
    case Kind::kClock:
      map.key(kRequired, "program", fault.program, kProgram);
      return map.key(kRequired, "jump_s", fault.value, kJump);
    case Kind::kDiskFull:
      map.key(kRequired, "program", fault.program, kRecorder);
      return lasts();
    case Kind::kRequest:
      map.key(kRequired, "program", fault.program, kServer);
      return map.decide("action", fault.action, [&](Action action) {
        if (action == Action::kStep) map.key(kRequired, "steps", fault.value, kSteps);
      });
    case Kind::kRefuse:
    case Kind::kBlock:
      map.key(kRequired, "program", fault.program, kServer);
      return lasts();
    case Kind::kPartition:
    case Kind::kStall:
      return lasts();
    case Kind::kClog:
      map.key(kRequired, "bandwidth_mbit", fault.value, kBandwidth);
      return lasts();
  }
}

template <class Map>
void describe(Map& map, Fault& fault) {
  map.decide("kind", fault.kind, [&](Kind kind) { describe_effect(map, fault, kind); });
  map.choose(fault.is_at_step, {{false, {"at_s"}}, {true, {"step"}}});
  if (fault.is_at_step)
    map.key(kRequired, "step", fault.at, kStep);
  else
    map.key(kRequired, "at_s", fault.at, kTime);
}

template <class Map>
void describe(Map& map, Case& one) {
  map.key(kOptional, "name", one.name, kShortLabel);
  map.key(kOptional, "link", one.link);
  map.key(kOptional, "faults", one.faults, kFaultList);
  map.key(kOptional, "until_s", one.until_s, kTime);
}

/// Either a list of cases or the keys of a single one.
struct File {
  bool has_list = false;
  std::vector<Case> cases;
  Case single;
};
template <class Map>
void describe(Map& map, File& file) {
  map.choose(file.has_list, {{true, {"cases"}}, {false, {"link", "faults"}}});
  if (file.has_list)
    map.key(kRequired, "cases", file.cases, kCases);
  else
    describe(map, file.single);
}

/// The tool's own limits, which the file must keep.
class LimitCheck {
 public:
  LimitCheck(const Abilities& abilities, const Places& places)
      : abilities_(abilities), places_(places) {}

  void check(Case& one, const std::string& path) const {
    for (const char* key : {"delay_ms", "jitter_ms", "loss", "reordering", "reordering_ms",
                            "duplicates", "bandwidth_mbit", "mtu_bytes", "multicast"})
      check_key(path + "link.", key, std::string("link.") + key);
    check_key(path, "until_s", "until_s");
    for (std::size_t i = 0; i < one.faults.size(); ++i) {
      Fault& fault = one.faults[i];
      const std::string of_fault = path + "faults[" + std::to_string(i) + "]";
      const std::string kind = config::to_yaml_value(fault.kind);
      if (abilities_.words.count(kind) == 0) refuse(of_fault + ".kind", kind);
      check_key(of_fault + ".", "step", "step");
      for (const char* key : {"program", "from", "to"})
        if (places_.has(of_fault + "." + key))
          check_program(key == std::string("to") ? fault.to : fault.program, of_fault + "." + key);
      fault.place = places_.make_error_at(of_fault, "").what();
      fault.place.resize(fault.place.size() - 2);  // without ": "
    }
  }

 private:
  void check_key(const std::string& prefix, const std::string& key, const std::string& word) const {
    if (places_.has(prefix + key) && abilities_.words.count(word) == 0) refuse(prefix + key, word);
  }
  void check_program(const Program& program, const std::string& path) const {
    std::string name = to_yaml_value(program);
    if (program.number == 1) name += "-1";
    if (!abilities_.programs.empty() && abilities_.programs.count(name) == 0)
      fail(path, abilities_.programs, name);
  }
  [[noreturn]] void refuse(const std::string& path, const std::string& got) const {
    fail(path, abilities_.words, got);
  }
  [[noreturn]] void fail(const std::string& path, const std::set<std::string>& able,
                         const std::string& got) const {
    std::string all;
    for (const std::string& word : able) all += (all.empty() ? "" : ", ") + word;
    throw places_.make_error_at(
        path, "expected what " + abilities_.tool + " can do (" + all + "), got " + got);
  }

  const Abilities& abilities_;
  const Places& places_;
};

std::vector<Case> parse(const std::string& text, const std::string& place,
                        const Abilities& abilities) {
  const YamlNode root = parse_yaml(text, place);
  const Models none;
  Places places(place, none);
  places.add("", root.line);
  File file;
  config::read_value(Value{root, "", root.line, places}, file);
  const LimitCheck limits(abilities, places);
  if (!file.has_list) {
    limits.check(file.single, "");
    return {file.single};
  }
  for (std::size_t i = 0; i < file.cases.size(); ++i)
    limits.check(file.cases[i], "cases[" + std::to_string(i) + "].");
  return file.cases;
}

std::vector<Case> load(const std::filesystem::path& file, const Abilities& abilities) {
  return parse(read_config_file(file, "a file of faults"), file.string(), abilities);
}

std::string to_line(const Fault& fault) {
  Fault copy = fault;  // one description serves reader and writer, so it takes no const
  const Models none;
  std::string text;
  MapWriter writer(text, none);
  describe(writer, copy);
  std::string line = "{ ";
  for (const char c : text.substr(0, text.size() - 1)) line += c == '\n' ? ", " : std::string(1, c);
  return line + " }";
}

std::vector<ListedKey> list_keys() {
  const Models none;
  return list_keys_of<Case>(none);
}

}  // namespace sls::config::faults
