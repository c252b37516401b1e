/// Joins the domain with a QoS file's own participant and sees who is there: programs, their
/// writers and readers, what arrives from them; and exchanges samples with other doctors.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"
#include "tools/doctor/endpoint.hpp"

namespace sls::doctor {

/// The name of a doctor's participant.
inline constexpr const char* kDoctorName = "sls_doctor";

/// A participant that the middleware discovered.
struct Program {
  bus::PeerId id;
  std::string name;
  std::string user;
  std::string address;                             ///< one that it announces; empty if none
  std::vector<std::uint32_t> udp_ports;            ///< on which it takes samples
  std::vector<std::uint32_t> shared_memory_ports;  ///< likewise
  bool is_on_this_host = false;
  bool is_secured = false;
  bool is_rejected = false;  ///< by DDS Security
  bool is_discovery_server = false;
  int samples = 0;           ///< that came from it
  bool is_expected = false;  ///< it has a latched writer that reaches us
  /// The least time between writing and taking a sample that was written while we listened, by the
  /// two clocks.
  std::optional<std::chrono::nanoseconds> delay;
};

class Observer {
 public:
  struct Options {
    std::filesystem::path qos_file;
    int domain = 0;
    std::string identity;
    std::string peer_address;  ///< who is asked directly, too; empty: nobody
    bool is_answering = false;
  };
  /// @throws config::ConfigError as Node does; BusError where the domain cannot be joined.
  explicit Observer(const Options& options);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Asks the other doctors for samples of each size that has not come back yet.
  void ask();
  /// Answers those who asked. From one thread, which is not the middleware's.
  void answer();

  std::vector<Program> programs() const;
  /// Theirs.
  std::vector<Endpoint> endpoints() const;
  /// Endpoints made from the profiles of the QoS file, by topic.
  std::vector<Endpoint> own_endpoints() const;
  /// Sample size, bytes → came back.
  std::map<std::uint32_t, bool> echoes() const;
  /// Why the doctor's own topic is refused; empty if it is not.
  const std::string& refusal() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sls::doctor
