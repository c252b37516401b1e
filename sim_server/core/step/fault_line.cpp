#include "sim_server/core/step/fault_line.hpp"

#include <cstddef>
#include <optional>
#include <variant>

#include "common/model/dice.hpp"
#include "common/model/offset.hpp"
#include "sim_server/plants/sensing/delay_line.hpp"

namespace sls::sim {
namespace {

using model::Dice;

// --- offsets -------------------------------------------------------------------------------------

Eigen::Vector3d add(const Eigen::Vector3d& f_Q_W, const config::SampleOffset& offset, double) {
  return f_Q_W + offset.force;
}

/// One draw for a state. Components are numbered in the order of the keys.
config::SampleOffset draw(const config::SampleOffset& deviation, const Dice& dice,
                          const model::Measurement&) {
  config::SampleOffset offset;
  offset.position = deviation.position.cwiseProduct(dice.calc_normals(0));
  offset.velocity = deviation.velocity.cwiseProduct(dice.calc_normals(3));
  if (!model::moves_rod(deviation.rod)) return offset;
  offset.rod.alpha = deviation.rod.alpha * dice.calc_normal(6);
  offset.rod.beta = deviation.rod.beta * dice.calc_normal(7);
  offset.rod.alpha_dot = deviation.rod.alpha_dot * dice.calc_normal(8);
  offset.rod.beta_dot = deviation.rod.beta_dot * dice.calc_normal(9);
  return offset;
}

config::SampleOffset draw(const config::SampleOffset& deviation, const Dice& dice,
                          const Eigen::Vector3d&) {
  config::SampleOffset offset;
  offset.force = deviation.force.cwiseProduct(dice.calc_normals(0));
  return offset;
}

// --- receivers -----------------------------------------------------------------------------------

/// Constants of one scenario.
struct Timing {
  std::int64_t period_ns;
  double rod_length;  ///< m
};

/// The receiving end of a channel with one fault: it holds the sample that arrived last.
template <class Sample>
class Receiver {
 public:
  /// `index` is the fault's place in the file.
  Receiver(const config::Fault& fault, std::size_t index, const Timing& timing)
      : fault_(fault), index_(index), timing_(timing) {}

  /// The sample held at `step`, at which `sample` was sent.
  Sample take(std::uint64_t step, const Sample& sample) {
    if (!held_) held_ = sent_before_ = sample;  // the first sample, until one arrives
    const auto time_ns = static_cast<std::int64_t>(step) * timing_.period_ns;
    const bool is_active = fault_.from_ns <= time_ns && time_ns < fault_.to_ns;
    std::visit([&](const auto& effect) { receive(effect, is_active, step, sample); },
               fault_.effect);
    sent_before_ = sample;
    return *held_;
  }

 private:
  bool happens(double probability, std::uint64_t seed, std::uint64_t step) const {
    return Dice(seed, index_, step).calc_uniform(0) <= probability;
  }

  void receive(const config::DelayFault& delay, bool is_active, std::uint64_t step,
               const Sample& sample) {
    const std::int64_t periods = delay.by_ns / timing_.period_ns;
    const auto at = static_cast<std::int64_t>(step);
    under_way_.put(at, sample);
    const Sample& delayed = under_way_.take(at - periods);
    held_ = is_active ? delayed : sample;
  }

  void receive(const config::DropFault& drop, bool is_active, std::uint64_t step,
               const Sample& sample) {
    if (!is_active || !happens(drop.probability, drop.seed, step)) held_ = sample;
  }

  void receive(const config::FreezeFault&, bool is_active, std::uint64_t, const Sample& sample) {
    if (!is_active) held_ = sample;
  }

  void receive(const config::ReorderFault& reorder, bool is_active, std::uint64_t step,
               const Sample& sample) {
    const bool is_late = is_active && happens(reorder.probability, reorder.seed, step);
    if (!is_late) held_ = sample;
    if (was_late_) held_ = sent_before_;  // it arrives after `sample`
    was_late_ = is_late;
  }

  void receive(const config::BiasFault& bias, bool is_active, std::uint64_t, const Sample& sample) {
    held_ = is_active ? add(sample, bias.offset, timing_.rod_length) : sample;
  }

  void receive(const config::NoiseFault& noise, bool is_active, std::uint64_t step,
               const Sample& sample) {
    held_ = sample;
    if (!is_active) return;
    const config::SampleOffset offset =
        draw(noise.deviation, Dice(noise.seed, index_, step), sample);
    held_ = add(sample, offset, timing_.rod_length);
  }

  config::Fault fault_;
  std::size_t index_;
  Timing timing_;
  std::optional<Sample> held_;
  Sample sent_before_;           // at the previous step
  bool was_late_ = false;        // `sent_before_`, by a reorder
  DelayLine<Sample> under_way_;  // samples in a delay
};

/// Receivers in series: each gets the sample that the previous one holds.
template <class Sample>
Sample pass(std::vector<Receiver<Sample>>& receivers, std::uint64_t step, Sample sample) {
  for (Receiver<Sample>& receiver : receivers) sample = receiver.take(step, sample);
  return sample;
}

}  // namespace

struct FaultLine::Channels {
  std::vector<Receiver<model::Measurement>> state;
  std::vector<Receiver<Eigen::Vector3d>> command;
};

FaultLine::FaultLine(const config::Scenario& scenario, std::uint32_t vehicle_id)
    : channels_(std::make_unique<Channels>()) {
  const Timing timing{scenario.sync.period_ns, scenario.vehicle.rod_length};
  for (std::size_t i = 0; i < scenario.faults.size(); ++i) {
    const config::Fault& fault = scenario.faults[i];
    if (static_cast<std::uint32_t>(fault.vehicle) != vehicle_id) continue;
    if (fault.on == config::FaultChannel::kState)
      channels_->state.emplace_back(fault, i, timing);
    else
      channels_->command.emplace_back(fault, i, timing);
  }
}

FaultLine::~FaultLine() = default;
FaultLine::FaultLine(FaultLine&&) noexcept = default;

bool FaultLine::can_disturb_state() const { return !channels_->state.empty(); }

model::Measurement FaultLine::measure(std::uint64_t step, const model::Measurement& truth) {
  return pass(channels_->state, step, truth);
}

Eigen::Vector3d FaultLine::actuate(std::uint64_t step, const Eigen::Vector3d& f_Q_W) {
  return pass(channels_->command, step, f_Q_W);
}

}  // namespace sls::sim
