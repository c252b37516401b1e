#include "sim_server/state_stream.hpp"

#include <algorithm>

namespace sls::sim {

StateStream::StateStream(bus::Node& node, std::size_t vehicles) {
  if (vehicles == 1) {
    vehicle_writer_.emplace(node);
    return;
  }
  fleet_writer_.emplace(node);
  for (std::size_t first = 0; first < vehicles; first += FLEET_SAMPLE_VEHICLES)
    fleet_.emplace_back().vehicles().resize(
        std::min<std::size_t>(vehicles - first, FLEET_SAMPLE_VEHICLES));
}

VehicleState& StateStream::at(std::size_t index) {
  return is_fleet()
             ? fleet_[index / FLEET_SAMPLE_VEHICLES].vehicles()[index % FLEET_SAMPLE_VEHICLES]
             : vehicle_;
}

void StateStream::write_where(const std::function<bool(std::size_t)>& is_wanted) {
  if (!is_fleet()) {
    if (!is_wanted(0)) return;
    queue_ ? queue_->vehicle_->write(vehicle_) : vehicle_writer_->write(vehicle_);
    return;
  }
  std::size_t index = 0;
  for (FleetState& sample : fleet_) {
    bool is_sample_wanted = false;
    for (std::size_t i = 0; i < sample.vehicles().size(); ++i, ++index)
      is_sample_wanted = is_sample_wanted || is_wanted(index);
    if (!is_sample_wanted) continue;
    sample.run_id(sample.vehicles().front().run_id());
    sample.step(sample.vehicles().front().step());
    queue_ ? queue_->fleet_->write(sample) : fleet_writer_->write(sample);
  }
}

int StateStream::history_depth() const {
  return is_fleet() ? fleet_writer_->history_depth() / static_cast<int>(fleet_.size())
                    : vehicle_writer_->history_depth();
}

void StateStream::wait_for_acknowledgments(std::chrono::milliseconds limit) {
  is_fleet() ? fleet_writer_->wait_for_acknowledgments(limit)
             : vehicle_writer_->wait_for_acknowledgments(limit);
}

StateStream::Queue::Queue(StateStream& stream, std::size_t steps) : stream_(stream) {
  if (stream.is_fleet())
    fleet_.emplace(*stream.fleet_writer_, steps * stream.fleet_.size());
  else
    vehicle_.emplace(*stream.vehicle_writer_, steps);
  stream.queue_ = this;
}

StateStream::Queue::~Queue() {
  if (stream_.queue_ == this) stream_.queue_ = nullptr;  // else its successor is in place
}

std::uint64_t StateStream::Queue::lost() const {
  return stream_.is_fleet() ? fleet_->lost() : vehicle_->lost();
}

}  // namespace sls::sim
