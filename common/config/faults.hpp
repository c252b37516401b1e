/// Faults of networks, machines and programs, as a file describes them: one vocabulary for worlds,
/// chaos and network-table. docs/faults.md describes it.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/config/key_lister.hpp"

namespace sls::config::faults {

/// A number, or a range from which a tool draws with its seed.
struct Span {
  double least = 0;
  double most = 0;
};

enum class Role { kServer, kController, kRecorder };
struct Program {
  Role role = Role::kServer;
  int number = 1;  ///< from 1
};
std::string to_yaml_value(const Program& program);
std::string to_yaml_value(const Span& span);

/// The network between hosts. A tool has its own defaults for what the file leaves out.
struct Link {
  std::optional<Span> delay_ms, jitter_ms, loss, reordering, reordering_ms, duplicates,
      bandwidth_mbit, mtu_bytes;
  bool has_multicast = true;
};

enum class Kind {
  kKill,
  kPowerCut,
  kStop,
  kInterrupt,
  kCut,
  kIsolate,
  kLoss,
  kSlow,
  kClock,
  kDiskFull,
  kRequest,
  kPartition,
  kClog,
  kStall,
  kRefuse,
  kBlock,
};
inline std::array<Name<Kind>, 16> names_of(Kind) {
  return {{{"kill", Kind::kKill},
           {"power-cut", Kind::kPowerCut},
           {"stop", Kind::kStop},
           {"interrupt", Kind::kInterrupt},
           {"cut", Kind::kCut},
           {"isolate", Kind::kIsolate},
           {"loss", Kind::kLoss},
           {"slow", Kind::kSlow},
           {"clock", Kind::kClock},
           {"disk-full", Kind::kDiskFull},
           {"request", Kind::kRequest},
           {"partition", Kind::kPartition},
           {"clog", Kind::kClog},
           {"stall", Kind::kStall},
           {"refuse", Kind::kRefuse},
           {"block", Kind::kBlock}}};
}
/// As ControlAction in idl/sls.idl.
enum class Action { kStart, kPause, kStep, kResume, kReset, kStop };
inline std::array<Name<Action>, 6> names_of(Action) {
  return {{{"start", Action::kStart},
           {"pause", Action::kPause},
           {"step", Action::kStep},
           {"resume", Action::kResume},
           {"reset", Action::kReset},
           {"stop", Action::kStop}}};
}

struct Fault {
  std::string place;  ///< FILE:LINE: KEY, for errors
  Kind kind = Kind::kKill;
  Program program;                ///< that it hits, or on whose host it happens
  Program to;                     ///< of a cut: the other end
  std::optional<Span> restart_s;  ///< of a kill or power cut: time until a new process begins
  Span for_s;
  Span value;  ///< loss, late_s, jump_s, bandwidth_mbit or steps
  Action action = Action::kPause;
  bool is_at_step = false;
  Span at;  ///< s after the start, or a step
};

/// The network and faults of one flight.
struct Case {
  std::string name;
  Link link;
  std::vector<Fault> faults;
  std::optional<Span> until_s;  ///< then all faults are over, and the link is good
};

/// The words that a tool understands. A file with others is refused.
struct Abilities {
  std::string tool;                ///< in errors
  std::set<std::string> words;     ///< kinds, and keys: those of links, `step`, `until_s`
  std::set<std::string> programs;  ///< such as `recorder-1`; empty: all
};

/// The cases of `file`, at least one.
/// @throws ConfigError `FILE:LINE: KEY: expected …, got …`.
std::vector<Case> load(const std::filesystem::path& file, const Abilities& abilities);
std::vector<Case> parse(const std::string& text, const std::string& place,
                        const Abilities& abilities);

/// `fault` as a file has it: `{ kind: stop, program: recorder, for_s: 2, at_s: 1.5 }`.
std::string to_line(const Fault& fault);

std::vector<ListedKey> list_keys();

}  // namespace sls::config::faults

namespace sls::config {
template <>
inline constexpr bool kOnOneLine<faults::Span> = true;
template <>
inline constexpr bool kOnOneLine<faults::Program> = true;
}  // namespace sls::config
