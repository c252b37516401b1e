/// Passes the samples of the domain to the sessions, on the server's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/node.hpp"
#include "common/sync/servers.hpp"

namespace sls::view {

/// Number of the newest events that a page gets when it connects.
inline constexpr std::size_t kPastEvents = 200;

using bus::kTopics;
using bus::TopicId;

const char* name_of(TopicId topic);  ///< "sls/state"
const char* type_of(TopicId topic);  ///< "sls::States"

/// True for the topics whose samples are rare and must reach a late joiner. They are never dropped,
/// except in a flood.
constexpr bool is_latched(TopicId topic) {
  return topic != TopicId::kState && topic != TopicId::kCommand && topic != TopicId::kRecord;
}

/// A sample as received.
struct Sample {
  TopicId topic;
  std::shared_ptr<const std::vector<std::uint8_t>> cdr;  ///< with its encapsulation header
  std::int64_t written_ns = 0;                           ///< wall clock of its writer
  bus::PeerId sender;
};

/// The page's view of the run of vehicle `--vehicle`: the current run; after its end the run that
/// can be joined, otherwise the last one.
struct RunView {
  sync::Run run;  ///< parameters and last status
  std::vector<Participant> participants;
  bool is_silent = false;  ///< the run goes on, but its server has not published for 1 s
  double silence_s = 0;
  bool is_gone = false;  ///< its server has left
};

/// An event of a run: a new reason in its status.
struct RunEvent {
  std::uint64_t run_id = 0;
  std::uint64_t step = 0;
  std::string text;
};

/// Reads the domain best-effort and passes the samples to listeners on the server's thread, in
/// batches. The first sample after a pause is passed at once, then at most 60 batches a second, 20
/// in lockstep. Reads the latched topics always, sls/record while there is a listener, sls/state
/// and sls/command while `want` requests them.
class Feed {
 public:
  using Post = std::function<void(std::function<void()>)>;

  /// Limit of the samples that wait for the server's thread. Beyond it the oldest are dropped;
  /// samples of latched topics last.
  static constexpr std::size_t kMostQueuedBytes = 16 << 20;

  /// `post`: Server::post.
  Feed(bus::Node& node, std::uint32_t vehicle_id, Post post);
  virtual ~Feed();

  struct Listener {
    virtual ~Listener() = default;
    /// Called for every sample of a topic that is read, each topic in order of arrival. If the
    /// server's thread is behind, the oldest are dropped.
    virtual void note(const Sample& /*sample*/) {}
    /// Called after a batch of samples, at most every 1/60 s, in lockstep every 1/20 s. For
    /// listeners that use only the newest samples.
    virtual void end_batch() {}
    /// The run, its status or its participants have changed; null: there is none.
    virtual void note(const RunView* /*run*/) {}
    virtual void note_event(const RunEvent& /*event*/) {}
  };
  /// Call all these functions on the server's thread. A new listener gets the run and the past
  /// events at once.
  virtual void add(Listener& listener);
  virtual void remove(Listener& listener);
  /// Counted: the topic is read until `unwant` has been called as often. No effect on topics that
  /// are always read.
  virtual void want(TopicId topic);
  virtual void unwant(TopicId topic);
  /// The current run.
  const RunView* run() const;
  /// The last samples of a latched topic, for late subscribers.
  virtual std::vector<Sample> latched(TopicId topic) const;
  /// Samples dropped so far because the server's thread was behind.
  std::uint64_t dropped() const;

 protected:
  Feed();  ///< of a test's own, which overrides what it needs

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sls::view
