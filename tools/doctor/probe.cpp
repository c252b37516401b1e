#include "tools/doctor/probe.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <random>

namespace sls::doctor {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kSmall = 256;  // bytes of a probe whose size does not matter
constexpr std::array<std::size_t, 3> kSizes = {1400, 8000, 60000};
constexpr auto kInterval = std::chrono::milliseconds(250);
constexpr int kAttempts = 8;
constexpr int kSizeAttempts = 12;
/// After six refusals a host refuses only about one datagram a second. A datagram without a refusal
/// counts as lost only if several of the smallest size, sent alternately, were refused.
constexpr int kRefusedSizeAttempts = 6, kLeastRefused = 3;
/// Start-up time of an answerer that starts together with this process.
constexpr auto kStartTime = std::chrono::milliseconds(1500);

/// An RTPS message (no vendor, version 2.2) with one vendor-specific submessage, which participants
/// skip. Both ends are little-endian, as all supported machines are.
struct Probe {
  std::array<char, 4> protocol = {'R', 'T', 'P', 'S'};
  std::array<std::uint8_t, 4> version_and_vendor = {2, 2, 0, 0};
  std::array<char, 12> sender = {'s', 'l', 's', ' ', 'd', 'o', 'c', 't', 'o', 'r', ' ', ' '};
  std::array<std::uint8_t, 4> submessage = {0x80, 0x01, 0, 0};  // length 0: up to the end
  std::uint32_t is_answer = 0;
  std::uint32_t answer_port = 0;  ///< the asking host's port for unsolicited answers; 0: none
  std::uint32_t is_unasked = 0;   ///< 1: an answer from another port than the one asked
  std::uint64_t nonce = 0;
  std::uint64_t question = 0;
  std::int64_t asked_ns = 0;     ///< wall clock of the asking doctor
  std::int64_t answered_ns = 0;  ///< wall clock of the answering doctor
};
static_assert(sizeof(Probe) <= kSmall);

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::optional<Probe> parse(const std::vector<unsigned char>& buffer, std::size_t size) {
  const Probe expected;
  Probe probe;
  if (size < sizeof probe) return std::nullopt;
  std::memcpy(&probe, buffer.data(), sizeof probe);
  if (probe.protocol != expected.protocol || probe.sender != expected.sender ||
      probe.submessage != expected.submessage)
    return std::nullopt;
  return probe;
}

std::vector<unsigned char> make_datagram(const Probe& probe, std::size_t size) {
  std::vector<unsigned char> bytes(std::max(size, sizeof probe));
  std::memcpy(bytes.data(), &probe, sizeof probe);
  return bytes;
}

}  // namespace

std::uint64_t choose_nonce() {
  std::random_device source;
  return std::uint64_t{source()} << 32 | source();
}

// --- answerer ------------------------------------------------------------------------------------

ProbeAnswerer::ProbeAnswerer(const Ports& ports) {
  // Bound to the group, it receives only multicast and takes no unicast from a participant.
  multicast_.bind(kMulticastGroup, ports.multicast(), true);
  multicast_.join(kMulticastGroup, find_interfaces());
  for (int id = kHighestProbeId; id >= kLowestProbeId && unicast_.empty(); --id) {
    UdpSocket metatraffic, user;
    if (!metatraffic.bind("0.0.0.0", ports.metatraffic(id)) ||
        !user.bind("0.0.0.0", ports.user(id)))
      continue;
    unicast_.push_back(std::move(metatraffic));
    unicast_.push_back(std::move(user));
  }
}

void ProbeAnswerer::answer(std::chrono::milliseconds limit) {
  std::vector<pollfd> waiting = {{multicast_.descriptor(), POLLIN, 0}};
  for (const UdpSocket& socket : unicast_) waiting.push_back({socket.descriptor(), POLLIN, 0});
  ::poll(waiting.data(), waiting.size(), static_cast<int>(limit.count()));
  answer_from(multicast_, unicast_.empty() ? outgoing_ : unicast_.front());
  for (UdpSocket& socket : unicast_) answer_from(socket, socket);
}

void ProbeAnswerer::answer_from(UdpSocket& socket, UdpSocket& answering) {
  while (const auto received = socket.receive(buffer_)) {
    auto probe = parse(buffer_, received->size);
    if (!probe || probe->is_answer) continue;
    probe->is_answer = 1;
    probe->answered_ns = now_ns();
    const auto answer = make_datagram(*probe, received->size);
    answering.send_to(received->sender, answer.data(), answer.size());
    if (probe->answer_port == 0 || probe->answer_port > std::numeric_limits<std::uint16_t>::max())
      continue;
    probe->is_unasked = 1;
    const auto unasked = make_datagram(*probe, kSmall);
    sockaddr_in there = received->sender;
    there.sin_port = htons(static_cast<std::uint16_t>(probe->answer_port));
    outgoing_.send_to(there, unasked.data(), unasked.size());
  }
}

// --- prober --------------------------------------------------------------------------------------

struct Prober::Question {
  enum class Kind { kPort, kSize, kMulticast };
  Kind kind;
  std::size_t size;
  sockaddr_in peer;
  UdpSocket socket;
  Clock::time_point due = Clock::now();
  bool is_spare = false;  ///< asked only if the first ports are silent
  bool is_settled = false;
  int attempts = 0;
  int refusals = 0;
};

bool Prober::is_given_up(const Question& question) const {
  int most = kAttempts;
  if (question.kind == Question::Kind::kSize)
    most = results_.is_answered ? kSizeAttempts : kRefusedSizeAttempts;
  return question.attempts >= most && Clock::now() >= question.due;
}

Prober::Prober(const Ports& ports, const std::string& peer,
               const std::vector<std::string>& multicast_by, bool is_peer_starting)
    : peer_(peer),
      is_peer_starting_(is_peer_starting),
      nonce_(choose_nonce()),
      began_(Clock::now()),
      best_round_trip_ns_(std::numeric_limits<std::int64_t>::max()) {
  results_.is_tried = true;
  for (int id = kLowestProbeId; id <= kHighestProbeId && !listening_; ++id) {
    UdpSocket socket;
    if (!socket.bind("0.0.0.0", ports.user(id))) continue;
    listening_port_ = ports.user(id);
    listening_.emplace(std::move(socket));
  }
  const auto add = [&](Question::Kind kind, std::size_t size, const sockaddr_in& to) {
    questions_.push_back(std::make_unique<Question>(Question{kind, size, to, {}}));
    return questions_.back().get();
  };
  // A connected socket reports that a port is closed. Further ports are tried if the first are
  // silent, because a participant may have the first ones.
  for (int id = kHighestProbeId; id >= kLowestProbeId; --id)
    for (const int port : {ports.metatraffic(id), ports.user(id)}) {
      auto* question = add(Question::Kind::kPort, kSmall, make_address(peer, port));
      question->is_spare = id != kHighestProbeId;
      if (!question->socket.connect(question->peer)) results_.is_unreachable = true;
      results_.own_address = question->socket.find_own_address();
    }
  for (const std::size_t size : kSizes) {
    results_.sizes[size] = false;
    add(Question::Kind::kSize, size, {});
  }
  for (const std::string& interface : multicast_by) {
    auto* question =
        add(Question::Kind::kMulticast, kSmall, make_address(kMulticastGroup, ports.multicast()));
    question->socket.send_multicast_by(interface);
  }
}

Prober::~Prober() = default;

void Prober::ask(Question& question) {
  Probe probe;
  probe.nonce = nonce_;
  probe.question = static_cast<std::uint64_t>(question.kind);
  probe.answer_port = static_cast<std::uint32_t>(listening_port_);
  probe.asked_ns = now_ns();
  const auto bytes = make_datagram(probe, question.size);
  ++question.attempts;
  question.due = Clock::now() + kInterval;
  if (question.kind == Question::Kind::kMulticast)
    question.socket.send_to(question.peer, bytes.data(), bytes.size());
  else
    question.socket.send(bytes.data(), bytes.size());
}

void Prober::take(UdpSocket& socket, Question* question) {
  for (int error = 0;;) {
    const auto received = socket.receive(buffer_, &error);
    if (!received && error == 0) return;
    if (!received) {
      if (error == EHOSTUNREACH || error == ENETUNREACH) results_.is_unreachable = true;
      if (error != ECONNREFUSED || !question) continue;
      // A refused datagram has arrived whole. Its port has no answerer, unless one is starting.
      results_.is_refused = true;
      ++question->refusals;
      if (!results_.is_answered) speaking_ = question->peer;
      if (question->kind == Question::Kind::kSize) results_.sizes[question->size] = true;
      question->is_settled = question->kind == Question::Kind::kSize
                                 ? question->size != kSizes.front() || is_every_size_through()
                                 : !is_peer_starting_ || Clock::now() > began_ + kStartTime;
      continue;
    }
    const auto probe = parse(buffer_, received->size);
    if (!probe || !probe->is_answer || probe->nonce != nonce_) continue;
    const std::string sender = to_string(received->sender.sin_addr);
    if (sender != peer_ && !(is_own_address(peer_) && is_own_address(sender))) continue;
    if (!question || probe->is_unasked) {
      results_.is_answered_unasked = true;
      continue;
    }
    question->is_settled = true;
    results_.is_unreachable = false;
    if (question->kind == Question::Kind::kMulticast) results_.is_multicast_answered = true;
    if (question->kind == Question::Kind::kSize) results_.sizes[question->size] = true;
    if (question->kind == Question::Kind::kPort) {
      results_.is_answered = true;
      speaking_ = question->peer;
    }
    // The shortest round trip gives the smallest error: the answer was written near its middle.
    const std::int64_t now = now_ns(), round_trip = now - probe->asked_ns;
    if (round_trip < best_round_trip_ns_) {
      best_round_trip_ns_ = round_trip;
      results_.clock_ahead =
          std::chrono::nanoseconds(probe->answered_ns - (probe->asked_ns + round_trip / 2));
    }
  }
}

bool Prober::is_every_size_through() const {
  return std::all_of(results_.sizes.begin(), results_.sizes.end(),
                     [](const auto& size) { return size.second; });
}

bool Prober::is_every_first_port_tried() const {
  return std::all_of(questions_.begin(), questions_.end(), [this](const auto& question) {
    return question->kind != Question::Kind::kPort || question->is_spare || question->is_settled ||
           is_given_up(*question);
  });
}

bool Prober::is_due(const Question& question) const {
  const auto now = Clock::now();
  if (question.is_settled || is_given_up(question) || now < question.due) return false;
  const bool is_first_try_over = now >= began_ + 2 * kInterval;
  switch (question.kind) {
    case Question::Kind::kPort:
      return !question.is_spare || (is_first_try_over && !results_.is_there());
    case Question::Kind::kSize:  // to a port that answers, otherwise to a closed one
      return speaking_ && !is_every_size_through() &&
             (results_.is_answered || is_every_first_port_tried());
    case Question::Kind::kMulticast:
      return true;
  }
  return true;
}

void Prober::work() {
  for (const auto& question : questions_) {
    take(question->socket, question.get());
    if (!is_due(*question)) continue;
    if (question->kind == Question::Kind::kSize && question->attempts == 0) {
      question->peer = *speaking_;
      question->socket.connect(question->peer);
    }
    ask(*question);
  }
  if (listening_) take(*listening_, nullptr);
}

bool Prober::is_done() const {
  const bool is_silent = !speaking_ && Clock::now() >= began_ + (kAttempts + 3) * kInterval;
  return std::all_of(questions_.begin(), questions_.end(), [&](const auto& question) {
    if (question->kind == Question::Kind::kSize && (is_silent || is_every_size_through()))
      return true;
    if (question->is_spare && results_.is_there()) return true;
    return question->is_settled || is_given_up(*question);
  });
}

ProbeResults Prober::results() const {
  ProbeResults results = results_;
  for (const auto& question : questions_)
    if (question->kind == Question::Kind::kSize && question->size == kSizes.front() &&
        !results.is_answered && question->refusals < kLeastRefused && !is_every_size_through())
      results.sizes.clear();  // too few refusals to judge
  return results;
}

bool is_host_up(const std::string& address, std::chrono::milliseconds limit) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return false;
  constexpr int kDiscardPort = 9;  // rarely open, rarely blocked
  const sockaddr_in there = make_address(address, kDiscardPort);
  int error = 0;
  if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0) {
    error = errno;
    pollfd waiting{descriptor, POLLOUT, 0};
    socklen_t size = sizeof error;
    if (error == EINPROGRESS && ::poll(&waiting, 1, static_cast<int>(limit.count())) == 1)
      ::getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &size);
  }
  ::close(descriptor);
  return error == 0 || error == ECONNREFUSED;
}

}  // namespace sls::doctor
