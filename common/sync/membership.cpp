#include "common/sync/membership.hpp"

#include <algorithm>
#include <utility>

#include "common/sync/room.hpp"

namespace sls::sync {
namespace {

using namespace std::chrono_literals;

// A participant that repeats an announcement twice at such intervals goes on with it. One that
// repeats it in a burst, or for another reason, need not.
constexpr auto kLeastInterval = 100ms, kLongestInterval = 1000ms;
constexpr int kRepeats = 2;
constexpr std::size_t kAges = 4;  // announcements: one of them was hardly delayed

}  // namespace

void Membership::note(const Participant& sample, const bus::PeerId& sender,
                      const Arrival& arrival) {
  const auto is_present = [this](const bus::PeerId& peer) { return present_.count(peer) > 0; };
  if (!make_room(last_, kMostMembers, sender, is_present)) return;
  const auto [known, is_new] = last_.try_emplace(sender);
  Heard& heard = known->second;
  const bool is_same_run = heard.announcement.run_id() == sample.run_id();
  if (!is_same_run || !sample.ready()) heard.ready_since.reset();
  if (sample.ready() && !heard.ready_since) heard.ready_since = arrival.time;
  const auto interval = arrival.written - std::exchange(heard.written, arrival.written);
  heard.time = arrival.time;
  heard.ages.push_back(arrival.age);
  if (heard.ages.size() > kAges) heard.ages.pop_front();
  if (!is_new && heard.announcement == sample) {
    if (interval >= kLeastInterval)
      heard.repeats = interval <= kLongestInterval ? heard.repeats + 1 : 0;
    return;
  }
  heard.repeats = 0;
  heard.announcement = sample;
  ++version_;
}

template <class IsWanted>
std::vector<Member> Membership::collect(const IsWanted& is_wanted) const {
  std::vector<Member> found;
  for (const auto& [peer, heard] : last_)
    if (is_wanted(heard.announcement) && present_.count(peer) > 0)
      found.push_back({peer, heard.announcement, heard.time,
                       *std::min_element(heard.ages.begin(), heard.ages.end()),
                       heard.ready_since.value_or(heard.time), heard.repeats >= kRepeats});
  return found;
}

std::vector<Member> Membership::find(ParticipantRole role, std::uint64_t run_id) const {
  return collect([&](const Participant& announcement) {
    return announcement.role() == role && announcement.run_id() == run_id;
  });
}

std::vector<Member> Membership::all() const {
  return collect([](const Participant&) { return true; });
}

int Membership::count_done(ParticipantRole role, std::uint64_t run_id) const {
  return static_cast<int>(std::count_if(last_.begin(), last_.end(), [&](const auto& item) {
    const Participant& announcement = item.second.announcement;
    return announcement.role() == role && announcement.run_id() == run_id && announcement.done();
  }));
}

bool are_recorders_done(const std::vector<Member>& recorders, Time now) {
  return std::all_of(recorders.begin(), recorders.end(), [now](const Member& member) {
    return member.announcement.done() || member.is_silent(now);
  });
}

bool flies_vehicle(const Participant& controller, std::uint32_t vehicle_id) {
  const auto& ids = controller.vehicle_ids();
  return std::find(ids.begin(), ids.end(), vehicle_id) != ids.end();
}

}  // namespace sls::sync
