/// The doctor's own datagrams on the RTPS ports. Without middleware they show which datagrams the
/// network carries. Each is a valid RTPS message with one submessage that every participant skips.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/doctor/udp_socket.hpp"

namespace sls::doctor {

/// Ports of a domain: RTPS 2.x, 9.6.1.
struct Ports {
  int base = 7400;
  int domain_gain = 250;
  int participant_gain = 2;
  int domain = 0;

  int multicast() const { return base + domain_gain * domain; }
  int metatraffic(int id) const { return multicast() + 10 + participant_gain * id; }
  int user(int id) const { return metatraffic(id) + 1; }
};

/// Participant ids whose ports the probes use: the highest that Fast DDS looks for on a host.
/// Programs take lower ids first, and a firewall open for programs also passes these ports.
inline constexpr int kHighestProbeId = 9, kLowestProbeId = 7;

/// A random number that marks the datagrams or samples of one doctor.
std::uint64_t choose_nonce();

/// Answers the probes of other doctors.
class ProbeAnswerer {
 public:
  explicit ProbeAnswerer(const Ports& ports);
  /// Waits for probes, at most `limit`, and answers them.
  void answer(std::chrono::milliseconds limit);

 private:
  void answer_from(UdpSocket& socket, UdpSocket& answering);

  UdpSocket multicast_;
  UdpSocket outgoing_;              ///< sends unsolicited answers: a port that was not asked
  std::vector<UdpSocket> unicast_;  ///< a metatraffic and a user port
  std::vector<unsigned char> buffer_;
};

/// Results of the probes.
struct ProbeResults {
  bool is_tried = false;
  std::string own_address;           ///< towards the peer
  bool is_unreachable = false;       ///< reported by the network
  bool is_answered = false;          ///< by a doctor, from the port that was asked
  bool is_refused = false;           ///< by the host: the port is closed, but the datagram arrived
  bool is_answered_unasked = false;  ///< by a doctor, from another port to one of ours
  bool is_multicast_answered = false;
  std::map<std::size_t, bool> sizes;  ///< size of datagram, bytes → was answered or refused
  std::optional<std::chrono::nanoseconds> clock_ahead;  ///< the peer's clock minus ours

  bool is_there() const { return is_answered || is_refused; }
};

/// Asks a host: by unicast, by multicast, with datagrams of several sizes.
class Prober {
 public:
  /// `multicast_by`: addresses of the interfaces by which multicast leaves; none: it is not tried.
  /// `is_peer_starting`: the answerer there is just starting.
  Prober(const Ports& ports, const std::string& peer, const std::vector<std::string>& multicast_by,
         bool is_peer_starting);
  ~Prober();

  /// Sends the probes that are due and takes the answers that have arrived.
  void work();
  /// True when every question is answered or has used up its attempts.
  bool is_done() const;
  ProbeResults results() const;

 private:
  struct Question;
  bool is_due(const Question& question) const;
  bool is_given_up(const Question& question) const;
  bool is_every_size_through() const;
  bool is_every_first_port_tried() const;
  void ask(Question& question);
  void take(UdpSocket& socket, Question* question);

  const std::string peer_;
  const bool is_peer_starting_;
  const std::uint64_t nonce_;
  const std::chrono::steady_clock::time_point began_;
  std::optional<sockaddr_in> speaking_;  ///< a port that answered, otherwise one that refused
  std::optional<UdpSocket> listening_;   ///< an RTPS port for unsolicited answers
  int listening_port_ = 0;
  std::vector<std::unique_ptr<Question>> questions_;
  ProbeResults results_;
  std::vector<unsigned char> buffer_;
  std::int64_t best_round_trip_ns_;
};

/// True if the host accepts or refuses a TCP connection, which shows that it is up.
bool is_host_up(const std::string& address, std::chrono::milliseconds limit);

}  // namespace sls::doctor
