#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "control_client/answerer.hpp"
#include "control_client/core/client_core.hpp"
#include "worlds/program.hpp"

namespace sls::worlds {

/// A client: ClientCore and Answerer with a simulated shell (control_client/client.hpp is the real
/// one).
class ClientProgram : public Program {
 public:
  struct Options {
    std::vector<std::uint32_t> vehicle_ids;
    std::int32_t strength = 0;
    bool follows_servers = false;
    bool has_other_scenario = false;  ///< a wrong file was given
    bool is_sloppy = false;   ///< one answer in 20 comes after one to another run, step or vehicle
    Instant compute_time{0};  ///< of an answer
    bool is_early = false;    ///< each answer is followed by one to the next step
    std::optional<std::uint64_t> breaks_at;  ///< from this step on it makes a mistake
    bool announces_once = false;  ///< unlike our clients, it does not repeat its announcement
    std::string announced_name;   ///< unlike the one in its answers; empty: the same
    bool has_library = false;     ///< a shared library, which others do not have
    bool says_done = false;       ///< although it still answers
    control::LawMaker make_law = &control::make_control_law;
  };
  ClientProgram(Setting& setting, Host& host, std::string name, const Options& options);
  void start() override;
  const Options& options() const { return options_; }
  bool has_flown() const { return answerer_ != nullptr; }
  bool keeps_contract() const { return !options_.breaks_at; }
  /// It answers and announces itself as our clients do.
  bool is_honest() const {
    return keeps_contract() && !options_.is_sloppy && !options_.is_early && !options_.has_library &&
           !options_.has_other_scenario && !options_.says_done && !options_.announces_once &&
           options_.announced_name.empty();
  }

 private:
  void wake() override;
  void begin();
  void announce_state();
  void on_states(const States& sample, const Peer::Arrival& arrival);
  void send(const Commands& answers);
  bool send_broken(const Commands& answers);
  void send_wrongly(const Commands& answers);

  const Options options_;
  config::Scenario scenario_;
  control::ClientCore core_;
  std::unique_ptr<control::Answerer> answerer_;
  std::string broken_;  // why a law is broken
};

}  // namespace sls::worlds
