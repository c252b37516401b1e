/// Datagrams of the doctor's own on the ports of RTPS: they find out what the network does to them,
/// without any middleware. Each is a valid RTPS message with one submessage that every participant
/// skips.
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

/// Participant ids whose ports the probes use: the highest that Fast DDS looks for on a host, so
/// that they neither take a port from a program nor lie outside what a firewall lets through.
inline constexpr int kHighestProbeId = 9, kLowestProbeId = 7;

/// Answers the probes of other doctors.
class ProbeAnswerer {
 public:
  explicit ProbeAnswerer(const Ports& ports);
  /// Answers what has come, waiting for it at most `limit`.
  void answer(std::chrono::milliseconds limit);

 private:
  void answer_from(UdpSocket& socket, UdpSocket& answering);

  UdpSocket multicast_;
  UdpSocket outgoing_;              ///< another port than the one that was asked: unsolicited
  std::vector<UdpSocket> unicast_;  ///< a metatraffic and a user port
  std::vector<unsigned char> buffer_;
};

/// Results of the probes.
struct ProbeResults {
  bool is_tried = false;
  std::string own_address;      ///< towards the peer
  bool is_unreachable = false;  ///< the network says so
  bool is_answered = false;     ///< by a doctor, from the port that was asked
  bool is_refused = false;      ///< by the host: nobody has the port, but the datagram got there
  bool is_answered_unasked = false;  ///< by a doctor, from another port to one of ours
  bool is_multicast_answered = false;
  std::map<std::size_t, bool> sizes;  ///< datagram, bytes → came back, or was refused when whole
  std::optional<std::chrono::nanoseconds> clock_ahead;  ///< the peer's clock minus ours

  bool is_there() const { return is_answered || is_refused; }
};

/// Asks a host: by unicast, by multicast, with datagrams of several sizes.
class Prober {
 public:
  /// `multicast_by`: addresses of the interfaces multicast leaves by; none: it is not tried.
  /// `is_peer_starting`: who answers there is started just now.
  Prober(const Ports& ports, const std::string& peer, const std::vector<std::string>& multicast_by,
         bool is_peer_starting);
  ~Prober();

  /// Sends what is due and takes what has come.
  void work();
  /// True when every question is answered, or was asked often enough.
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
  std::optional<sockaddr_in> speaking_;  ///< a port that answered, else one that was refused
  std::optional<UdpSocket> listening_;   ///< a port of RTPS, for answers from elsewhere
  int listening_port_ = 0;
  std::vector<std::unique_ptr<Question>> questions_;
  ProbeResults results_;
  std::vector<unsigned char> buffer_;
  std::int64_t best_round_trip_ns_;
};

/// True if the host accepts or refuses a TCP connection, which shows that it is up.
bool is_host_up(const std::string& address, std::chrono::milliseconds limit);

}  // namespace sls::doctor
