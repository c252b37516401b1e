#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "worlds/mistakes.hpp"
#include "worlds/program.hpp"

namespace sls::worlds {

/// A foreign client with mistakes: it answers late, twice, to other steps, runs and vehicles, or
/// with nonsense. Its announcement has a mistake or is missing, so none of its answers may ever be
/// applied. Some also pretend to be the server of the run.
class ForeignProgram : public Program {
 public:
  struct Options {
    bool is_wild = false;   ///< others may wait for it
    bool is_crowd = false;  ///< it has more participants than others remember
  };
  ForeignProgram(Setting& setting, Host& host, std::string name, const Options& options)
      : Program(setting, host, Role::kForeign, std::move(name)), options_(options) {}
  void start() override;

 private:
  void wake() override;
  void on_killed() override { leave_with_crowd(false); }
  void make_crowd();
  void leave_with_crowd(bool with_goodbye);
  void announce_wrongly(const Parameters& parameters);
  void answer(const States& sample);
  void pretend(const States& sample);

  const Options options_;
  Random random_{0};
  const AnnouncementMistake* mistake_ = nullptr;  // none: it announces nothing
  std::set<std::uint64_t> runs_;                  // whose parameters it has seen
  bool is_impostor_ = false;
  std::vector<Peer*> crowd_;
};

}  // namespace sls::worlds
