#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "worlds/mistakes.hpp"
#include "worlds/program.hpp"

namespace sls::worlds {

/// A client of somebody else that is wrong: it answers late, twice, to other steps, runs and
/// vehicles, or with nonsense. Its announcement has a mistake, or there is none, so no answer of it
/// may ever be applied. Some also pretend to be the server of the run.
class ForeignProgram : public Program {
 public:
  /// `is_wild`: others may wait for it.
  ForeignProgram(Setting& setting, Host& host, std::string name, bool is_wild)
      : Program(setting, host, Role::kForeign, std::move(name)), is_wild_(is_wild) {}
  void start() override;

 private:
  void wake() override;
  void announce_wrongly(const Parameters& parameters);
  void answer(const States& sample);
  void pretend(const States& sample);

  const bool is_wild_;
  Random random_{0};
  const AnnouncementMistake* mistake_ = nullptr;  // none: it announces nothing
  std::set<std::uint64_t> runs_;                  // whose parameters it has seen
  bool is_impostor_ = false;
};

}  // namespace sls::worlds
