#include "tools/view/ros_face/ros_face.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "common/sync/servers.hpp"
#include "tools/view/ros_face/newest_samples.hpp"
#include "tools/view/ros_face/publications.hpp"

namespace sls::view {
namespace {

using Clock = std::chrono::steady_clock;

/// Least time between two messages of a vehicle, for any speed of the flight.
constexpr auto kPeriod = std::chrono::milliseconds(10);

/// Most batches that wait to be decoded: several steps of 256 vehicles. Beyond it the oldest are
/// dropped.
constexpr std::size_t kMostBatches = 256;

}  // namespace

struct RosFace::Impl : Feed::Listener {
  Impl(bus::Node& node, Feed& source) : feed(source), publications(node) {
    feed.add(*this);
    feed.want(TopicId::kRecord);
    thread = std::thread([this] { work(); });
  }

  ~Impl() override {
    feed.unwant(TopicId::kRecord);
    feed.remove(*this);
    {
      const std::lock_guard lock(mutex);
      is_ending = true;
    }
    changed.notify_one();
    thread.join();
  }

  // --- on the server's thread ---

  void note(const Sample& sample) override {
    if (sample.topic != TopicId::kRecord || sample.sender != server) return;
    {
      const std::lock_guard lock(mutex);
      if (batches.size() == kMostBatches) batches.pop_front();
      batches.push_back(sample.cdr);
    }
    changed.notify_one();
  }

  void note(const RunView* view) override {
    if (!view) return;
    server = view->run.server;
    if (view->run.parameters.run_id() == run_id) return;
    run_id = view->run.parameters.run_id();
    {
      const std::lock_guard lock(mutex);
      new_run = view->run.parameters;
    }
    changed.notify_one();
  }

  // --- on `thread`: writing takes time, and the browsers must not wait for it ---

  void work() {
    try {
      while (wait_for_news()) {
        const auto next = Clock::now() + kPeriod;
        publish();
        wait_until(next);
      }
    } catch (const std::exception& error) {
      spdlog::error("ROS topics end: {}", error.what());
    }
  }

  bool wait_for_news() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [this] { return is_ending || new_run || !batches.empty(); });
    return !is_ending;
  }

  void wait_until(Clock::time_point time) {
    std::unique_lock lock(mutex);
    changed.wait_until(lock, time, [this] { return is_ending; });
  }

  void publish() {
    std::optional<Parameters> run;
    std::deque<Bytes> news;
    {
      const std::lock_guard lock(mutex);
      run = std::exchange(new_run, std::nullopt);
      news = std::exchange(batches, {});
    }
    if (run) {
      publications.begin(sync::list_vehicle_ids(*run), scene::read_load_scene(*run));
      newest.emplace(*run);
    }
    if (!newest || !publications.has_readers()) return;
    for (const ros::VehicleSample& sample : newest->take(news)) publications.publish(sample);
  }

  Feed& feed;
  std::uint64_t run_id = 0;             // used by the server's thread only
  bus::PeerId server{};                 // likewise
  Publications publications;            // used by `thread` only, once it runs
  std::optional<NewestSamples> newest;  // likewise
  std::mutex mutex;                     // protects the members below
  std::condition_variable changed;
  bool is_ending = false;
  std::optional<Parameters> new_run;  // its vehicles have no writers yet
  std::deque<Bytes> batches;
  std::thread thread;
};

RosFace::RosFace(bus::Node& node, Feed& feed) : impl_(std::make_unique<Impl>(node, feed)) {}
RosFace::~RosFace() = default;

}  // namespace sls::view
