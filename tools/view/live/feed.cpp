#include "tools/view/live/feed.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <thread>
#include <utility>

#include "tools/view/live/run_watch.hpp"
#include "tools/view/live/sample_queue.hpp"

namespace sls::view {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kLookTime = 100ms;   // between two looks at the run if no status has come
constexpr auto kRestTime = 20ms;    // least time between two looks, however many statuses come
constexpr auto kLongestQuiet = 1s;  // period of the view without a change
// Between two deliveries in lockstep. There the loop runs as fast as the processors allow, and each
// delivery takes processor time from it.
constexpr auto kLockstepPeriod = 50ms;
constexpr std::size_t kLatchedSamples = 256;  // of one topic

std::int64_t to_ns(std::chrono::system_clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

struct AnyTopicReader {
  virtual ~AnyTopicReader() = default;
};

using Put = std::function<void(Sample)>;

/// Makes fast samples wait in the socket, so that the middleware's thread takes many at a time. In
/// lockstep each wake-up of that thread takes a processor from the loop for longer than its work
/// (README.md). Samples that do not fit into the socket are lost to this reader only.
class Rests {
 public:
  /// Call it for each sample, before passing the sample on; from one thread.
  void rest_if_busy() {
    const auto now = Clock::now();
    ++samples_;
    if (now < window_end_) return;
    const bool is_busy = samples_ > kMostSamples;
    samples_ = 0;
    window_end_ = now + (is_busy ? kWholeRest + kWindow : kWholeRest);
    if (is_busy) std::this_thread::sleep_for(kWholeRest);
  }

 private:
  static constexpr int kMostSamples = 8;  // in a window
  static constexpr auto kWholeRest = 45ms;
  static constexpr auto kWindow = 5ms;  // for samples that have waited

  Clock::time_point window_end_{};
  int samples_ = 0;
};

/// Passes every sample of a topic to `put`, on a thread of the middleware.
template <class Message>
class TopicReader : public AnyTopicReader {
 public:
  /// `may_rest`: true while no listener requires every sample of sls/record.
  TopicReader(bus::Node& node, const Put& put, const std::atomic<bool>& may_rest)
      : reader_(node, is_latched(kTopic) ? bus::kLatchedReaderProfile : bus::kLoopReaderProfile,
                [this, &put, &may_rest](std::vector<std::uint8_t>& cdr, const bus::PeerId& sender) {
                  if (kTopic == TopicId::kRecord && may_rest) rests_.rest_if_busy();
                  put({kTopic, std::make_shared<const std::vector<std::uint8_t>>(std::move(cdr)),
                       to_ns(reader_.written()), sender});
                }) {}

 private:
  static constexpr TopicId kTopic = bus::Topic<Message>::kId;

  Rests rests_;
  bus::RawReader<Message> reader_;  // last: it uses the member above
};

template <class Message>
std::unique_ptr<AnyTopicReader> make_reader(bus::Node& node, const Put& put,
                                            const std::atomic<bool>& may_rest) {
  return std::make_unique<TopicReader<Message>>(node, put, may_rest);
}

/// By TopicId.
constexpr std::array kMakeReader = {make_reader<States>,      make_reader<Commands>,
                                    make_reader<RecordBatch>, make_reader<Participant>,
                                    make_reader<Parameters>,  make_reader<SimStatus>,
                                    make_reader<SimControl>,  make_reader<SimControlReply>};
static_assert(kMakeReader.size() == kTopics);

}  // namespace

const char* name_of(TopicId topic) { return bus::kTopicNames[static_cast<std::size_t>(topic)]; }

const char* type_of(TopicId topic) {
  constexpr std::array<const char*, kTopics> kNames = {
      "sls::States",     "sls::Commands",  "sls::RecordBatch", "sls::Participant",
      "sls::Parameters", "sls::SimStatus", "sls::SimControl",  "sls::SimControlReply"};
  return kNames[static_cast<std::size_t>(topic)];
}

struct Feed::Impl {
  Impl(bus::Node& bus_node, std::uint32_t vehicle_id, Post post_task)
      : node(bus_node), post(std::move(post_task)), watch(bus_node, vehicle_id, [this] {
          is_status_new = true;
          queue.interrupt();
        }) {
    for (std::size_t i = 0; i < kTopics; ++i)
      if (is_latched(static_cast<TopicId>(i))) update_reader(static_cast<TopicId>(i));
    thread = std::thread([this] { work(); });
  }

  ~Impl() {
    *is_alive = false;
    is_ending = true;
    queue.interrupt();
    thread.join();
    for (auto& reader : readers) reader.reset();  // before the members that their callbacks use
  }

  // --- on the middleware's threads and on `thread` ---

  void put(Sample sample) {
    if (queue.put(std::move(sample))) post_delivery();
  }

  void post_guarded(std::function<void()> task) {
    post([alive = is_alive, task = std::move(task)] {
      if (*alive) task();
    });
  }

  void post_delivery() {
    post_guarded([this] { deliver(queue.take_all()); });
  }

  /// Function of `thread`: delivers samples that came too soon after a delivery, and looks at the
  /// run.
  void work() {
    auto next_look = Clock::now();
    while (!is_ending) {
      if (queue.wait_until_due(next_look)) post_delivery();
      const auto now = Clock::now();
      const bool is_new = is_status_new && now >= looked + kRestTime;
      if (now >= next_look || is_new) {
        is_status_new = false;
        looked = now;
        look();
      }
      next_look = looked + (is_status_new ? kRestTime : kLookTime);
    }
  }

  void look() {
    auto found = watch.look();
    const bool is_lockstep = found && found->run.parameters.mode() == SyncMode::MODE_LOCKSTEP;
    queue.set_period(is_lockstep ? Clock::duration(kLockstepPeriod)
                                 : Clock::duration(SampleQueue::kPeriod));
    auto events = watch.take_events();
    const auto now = Clock::now();
    const bool is_told = watch.has_changed() || (found && now >= told + kLongestQuiet);
    if (!is_told && events.empty()) return;
    if (is_told) told = now;
    post_guarded([this, found = std::move(found), is_told, events = std::move(events)] {
      if (is_told) note_run(found);
      for (const RunEvent& event : events) note_event(event);
    });
  }

  // --- on the server's thread ---

  bool is_listening(const Listener* listener) const {
    return std::find(listeners.begin(), listeners.end(), listener) != listeners.end();
  }

  template <class Call>
  void for_each(const Call& call) {
    const std::vector<Listener*> all = listeners;  // a call may remove some
    for (Listener* listener : all)
      if (is_listening(listener)) call(*listener);
  }

  void deliver(const std::vector<Sample>& samples) {
    for (const Sample& sample : samples)
      if (is_latched(sample.topic)) keep(sample);
    for_each([&](Listener& listener) {
      for (const Sample& sample : samples) {
        listener.note(sample);
        if (!is_listening(&listener)) return;
      }
      listener.end_batch();
    });
  }

  /// Keeps the last kLatchedSamples requests and replies; of other topics the last sample of each
  /// sender.
  void keep(const Sample& sample) {
    std::vector<Sample>& kept = latched[static_cast<std::size_t>(sample.topic)];
    if (sample.topic != TopicId::kControl && sample.topic != TopicId::kControlReply)
      kept.erase(std::remove_if(kept.begin(), kept.end(),
                                [&](const Sample& old) { return old.sender == sample.sender; }),
                 kept.end());
    if (kept.size() >= kLatchedSamples) kept.erase(kept.begin());
    kept.push_back(sample);
  }

  void note_run(const std::shared_ptr<const RunView>& run) {
    view = run;
    update_rests();
    for_each([&](Listener& listener) { listener.note(view.get()); });
  }

  void note_event(const RunEvent& event) {
    past_events.push_back(event);
    if (past_events.size() > kPastEvents) past_events.pop_front();
    for_each([&](Listener& listener) { listener.note_event(event); });
  }

  bool is_read(TopicId topic) const {
    return is_latched(topic) || wanted[static_cast<std::size_t>(topic)] > 0 ||
           (topic == TopicId::kRecord && !listeners.empty());
  }

  /// Readers may rest if the flight is in lockstep and only pages read, which need only the newest
  /// samples.
  void update_rests() {
    const bool is_any_wanted =
        std::any_of(wanted.begin(), wanted.end(), [](int count) { return count > 0; });
    may_rest = !is_any_wanted && view && view->run.parameters.mode() == SyncMode::MODE_LOCKSTEP;
  }

  void update_reader(TopicId topic) {
    auto& reader = readers[static_cast<std::size_t>(topic)];
    if (!is_read(topic))
      reader.reset();
    else if (!reader)
      reader = kMakeReader[static_cast<std::size_t>(topic)](node, put_sample, may_rest);
  }

  bus::Node& node;
  const Post post;
  const std::shared_ptr<bool> is_alive = std::make_shared<bool>(true);  // server's thread
  const Put put_sample = [this](Sample sample) { put(std::move(sample)); };
  SampleQueue queue{kMostQueuedBytes};
  std::atomic<bool> is_status_new{false};
  std::atomic<bool> is_ending{false};
  std::atomic<bool> may_rest{false};
  RunWatch watch;              // used by `thread` only
  Clock::time_point looked{};  // likewise
  Clock::time_point told{};    // likewise

  std::vector<Listener*> listeners;
  std::array<int, kTopics> wanted{};
  std::array<std::vector<Sample>, kTopics> latched;
  std::shared_ptr<const RunView> view;
  std::deque<RunEvent> past_events;

  std::array<std::unique_ptr<AnyTopicReader>, kTopics> readers;
  std::thread thread;  // runs `work`; last: it uses the members above
};

Feed::Feed(bus::Node& node, std::uint32_t vehicle_id, Post post)
    : impl_(std::make_unique<Impl>(node, vehicle_id, std::move(post))) {}
Feed::Feed() = default;
Feed::~Feed() = default;

void Feed::add(Listener& listener) {
  impl_->listeners.push_back(&listener);
  impl_->update_reader(TopicId::kRecord);
  listener.note(impl_->view.get());
  for (const RunEvent& event : impl_->past_events) listener.note_event(event);
}

void Feed::remove(Listener& listener) {
  auto& listeners = impl_->listeners;
  listeners.erase(std::remove(listeners.begin(), listeners.end(), &listener), listeners.end());
  impl_->update_reader(TopicId::kRecord);
}

void Feed::want(TopicId topic) {
  ++impl_->wanted[static_cast<std::size_t>(topic)];
  impl_->update_rests();
  impl_->update_reader(topic);
}

void Feed::unwant(TopicId topic) {
  --impl_->wanted[static_cast<std::size_t>(topic)];
  impl_->update_rests();
  impl_->update_reader(topic);
}

const RunView* Feed::run() const { return impl_->view.get(); }

std::vector<Sample> Feed::latched(TopicId topic) const {
  return impl_->latched[static_cast<std::size_t>(topic)];
}

std::uint64_t Feed::dropped() const { return impl_->queue.dropped(); }

}  // namespace sls::view
