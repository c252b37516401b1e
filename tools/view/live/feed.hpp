/// Samples of the domain on the server's thread: what sessions see of a flight.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"

namespace sls::view {

enum class TopicId {
  kState,
  kCommand,
  kRecord,
  kParticipant,
  kParameters,
  kStatus,
  kControl,
  kControlReply
};
inline constexpr std::size_t kTopics = 8;

const char* name_of(TopicId topic);  ///< "sls/state"
const char* type_of(TopicId topic);  ///< "sls::States"

/// True of the topics whose samples come seldom and must reach a late joiner: never left out.
bool is_latched(TopicId topic);

/// A sample as it came over the wire.
struct Sample {
  TopicId topic;
  std::shared_ptr<const std::vector<std::uint8_t>> cdr;  ///< with its encapsulation header
  std::int64_t written_ns = 0;                           ///< wall clock of its writer
  bus::PeerId sender;
};

/// The page's view of the run: of vehicle `--vehicle`, the one that can be
/// joined, else the last one there was.
struct RunView {
  bus::Run run;  ///< parameters and last status
  std::vector<Participant> participants;
  bool is_silent = false;  ///< its server, whose run goes on, has not been heard for 1 s
  double silence_s = 0;
  bool is_gone = false;  ///< its server has left
};

/// Reads the domain best-effort and hands what comes to listeners on the server's thread, in
/// batches: the first sample after a rest at once, then at most 60 batches a second, in
/// lockstep 20. sls/record is read while there is a listener, sls/state and sls/command while
/// somebody wants them, the latched topics always.
class Feed {
 public:
  using Post = std::function<void(std::function<void()>)>;

  /// Samples that wait for the server's thread, at most: then the oldest are left out, but none of
  /// the latched topics.
  static constexpr std::size_t kMostQueuedBytes = 16 << 20;

  /// `post`: Server::post.
  Feed(bus::Node& node, std::uint32_t vehicle_id, Post post);
  ~Feed();

  struct Listener {
    virtual ~Listener() = default;
    /// Every sample of a wanted topic, in the order it came; of sls/record all batches, too, unless
    /// the server's thread is behind: then the oldest are left out.
    virtual void note(const Sample& /*sample*/) {}
    /// New samples were handed over. At least 1/60 s is between two of these, in lockstep 1/20 s.
    /// For all who work on the newest alone.
    virtual void end_batch() {}
    /// The run, its status or its participants have changed; null: there is none.
    virtual void note(const RunView* /*run*/) {}
    virtual void note_event(std::uint64_t /*run_id*/, std::uint64_t /*step*/,
                            const std::string& /*text*/) {}
  };
  /// All of these on the server's thread. A new listener is told the run and the past events at
  /// once.
  void add(Listener& listener);
  void remove(Listener& listener);
  /// Counted: the topic is read until as many `unwant`. Of topics that are read anyway nothing
  /// changes.
  void want(TopicId topic);
  void unwant(TopicId topic);
  /// The run that is looked at.
  const RunView* run() const;
  /// The last samples of a latched topic, for those who come late.
  std::vector<Sample> latched(TopicId topic) const;
  /// Samples left out so far, because the server's thread was behind.
  std::uint64_t dropped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sls::view
