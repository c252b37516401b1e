/// Joins the domain with the participant of a QoS file. Observes programs, their writers and
/// readers, and the samples that arrive from them; exchanges samples with other doctors.
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
  std::vector<std::uint32_t> udp_ports;            ///< on which it receives samples
  std::vector<std::uint32_t> shared_memory_ports;  ///< likewise
  bool is_on_this_host = false;
  bool is_secured = false;
  bool is_rejected = false;  ///< by DDS Security
  int samples = 0;           ///< received from it
  bool is_expected = false;  ///< one of its latched writers matches our reader
  /// Smallest difference between the times of receiving (our clock) and writing (its clock) a
  /// sample that was written after matching.
  std::optional<std::chrono::nanoseconds> delay;
};

class Observer {
 public:
  struct Options {
    std::filesystem::path qos_file;
    int domain = 0;
    std::string identity;
    std::string peer_address;  ///< host that discovery contacts directly, too; empty: none
    bool is_answering = false;
  };
  /// @throws config::ConfigError as Node does; BusError if the domain cannot be joined.
  explicit Observer(const Options& options);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Sends the other doctors a sample of each size that has not come back yet.
  void ask();
  /// Answers the doctors that have asked. Call it from one thread that is not the middleware's.
  void answer();

  std::vector<Program> programs() const;
  /// Discovered endpoints.
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
