#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "worlds/program.hpp"

namespace sls::worlds {

/// A client of somebody else that is wrong: it answers late, twice, to other steps, runs and
/// vehicles, or with nonsense. It has announced itself as not ready, with another scenario or
/// another contract, or not at all, so no answer of it may ever be applied. Some also pretend to be
/// the server of the run.
class ForeignProgram : public Program {
 public:
  ForeignProgram(Setting& setting, Host& host, std::string name)
      : Program(setting, host, Role::kForeign, std::move(name)) {}
  void start() override;

 private:
  void wake() override;
  void answer(const States& sample);
  void pretend(const States& sample);
  void announce_wrongly(std::uint64_t run_id);

  Random random_{0};
  std::uint64_t announced_run_ = 0;
  bool is_impostor_ = false;
};

}  // namespace sls::worlds
