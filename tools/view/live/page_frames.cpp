#include "tools/view/live/page_frames.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "common/bus/names.hpp"
#include "common/bus/node.hpp"
#include "tools/view/run_description.hpp"

namespace sls::view {
namespace {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "messages are little-endian");

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

template <class Number>
void append(std::string& message, Number number) {
  std::array<char, sizeof(Number)> bytes;
  std::memcpy(bytes.data(), &number, bytes.size());
  message.append(bytes.data(), bytes.size());
}

template <std::size_t n>
void append_floats(std::string& message, const std::array<double, n>& numbers) {
  for (const double number : numbers) append(message, static_cast<float>(number));
}

/// False for the entry of a late answer, and for unknown kinds of later contracts.
bool has_state(const RecordEntry& entry) {
  return bus::to_number(entry.kind()) < bus::to_number(AnswerKind::ANSWER_LATE);
}

/// The reference that the answer follows; if `may_be_held`, also that of a held older answer.
std::array<double, 3> find_reference(const RecordEntry& entry, bool may_be_held) {
  const AnswerKind kind = entry.kind();
  if (kind == AnswerKind::ANSWER_ACCEPTED || kind == AnswerKind::ANSWER_REFUSED ||
      (may_be_held && kind == AnswerKind::ANSWER_HELD))
    return entry.answer().reference().position_m();
  return {kNaN, kNaN, kNaN};
}

std::vector<std::size_t> find_rotor_signals(const Parameters& parameters) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < parameters.signals().size(); ++i)
    if (parameters.signals()[i].name().to_string() ==
        "rotor_" + std::to_string(found.size() + 1) + "_rad_s")
      found.push_back(i);
  return found;
}

/// At most `most` of `count` indices, evenly spaced, always including the last.
std::vector<std::size_t> thin(std::size_t count, std::size_t most) {
  std::vector<std::size_t> kept;
  const std::size_t n = std::min(count, most);
  for (std::size_t i = 1; i <= n; ++i) kept.push_back(i * count / n - 1);
  return kept;
}

}  // namespace

void PageFrames::start_run(const Parameters& parameters) {
  run_id_ = parameters.run_id();
  period_s_ = static_cast<double>(parameters.period_ns()) * 1e-9;
  has_attitude_ = parameters.has_attitude();
  signals_ = parameters.signals().size();
  rotor_signals_ = find_rotor_signals(parameters);
  scene_ = scene::read_load_scene(parameters);
  last_steps_.clear();
  for (const VehicleParameters& vehicle : parameters.vehicles())
    last_steps_[vehicle.vehicle_id()] = 0;
  samples_.clear();
  newest_.clear();
  count_ = 0;
}

double PageFrames::calc_time(std::uint64_t step) const {
  return static_cast<double>(step) * period_s_;
}

// --- decoding ------------------------------------------------------------------------------------

bool PageFrames::decode_one(const Sample& sample) {
  if (decoded_.size() == count_) decoded_.emplace_back();
  Decoded& decoded = decoded_[count_];
  if (!bus::decode(*sample.cdr, decoded.batch) || decoded.batch.run_id() != run_id_) return false;
  decoded.written_ns = sample.written_ns;
  ++count_;
  return true;
}

void PageFrames::note_newest(const RecordBatch& batch) {
  for (const RecordEntry& entry : batch.entries()) {
    if (!has_state(entry) || !has_vehicle(entry.vehicle_id())) continue;
    const auto [known, is_new] = newest_.try_emplace(entry.vehicle_id(), entry);
    if (!is_new && entry.step() > known->second.step()) known->second = entry;
  }
}

bool PageFrames::decode() {
  count_ = 0;
  newest_.clear();
  newest_written_ns_ = 0;
  std::size_t tried = 0;
  while (!samples_.empty() && tried < kMostBatches && newest_.size() < last_steps_.size()) {
    ++tried;
    const Sample sample = std::move(samples_.back());
    samples_.pop_back();
    if (!decode_one(sample)) continue;
    newest_written_ns_ = std::max(newest_written_ns_, sample.written_ns);
    note_newest(decoded_[count_ - 1].batch);
  }
  for (const std::size_t i :
       thin(samples_.size(), kMostRowBatches - std::min(kMostRowBatches, tried)))
    decode_one(samples_[i]);
  samples_.clear();
  return !newest_.empty();
}

std::string PageFrames::find_stage() const {
  const auto newest = newest_.find(lowest_vehicle());
  if (newest == newest_.end() || newest->second.kind() != AnswerKind::ANSWER_ACCEPTED) return {};
  return newest->second.answer().reference().stage_name().to_string();
}

// --- poses ---------------------------------------------------------------------------------------

float PageFrames::calc_rotor_rate(const RecordEntry& entry) const {
  const auto& signals = entry.truth().signals();
  double sum = 0;
  for (const std::size_t i : rotor_signals_) sum += i < signals.size() ? signals[i] : kNaN;
  return rotor_signals_.empty()
             ? kNaN
             : static_cast<float>(sum / static_cast<double>(rotor_signals_.size()));
}

void PageFrames::append_cable(std::string& message, const PlantState& state) const {
  const auto found = scene::read_cable(*scene_, state.signals());
  const scene::Cable cable = found.value_or(scene::Cable());
  const Eigen::Quaterniond& q = cable.q_WL;
  const double tension = found ? cable.tension : kNaN;
  append_floats(
      message, std::array<double, 8>{tension, cable.length, cable.is_taut ? 1.0 : 0.0, q.w(), q.x(),
                                     q.y(), q.z(), cable.is_released ? 1.0 : 0.0});
}

std::string PageFrames::make_poses() const {
  std::uint64_t step = 0;
  for (const auto& item : newest_) step = std::max(step, item.second.step());
  std::string message;
  message.reserve(40 + (scene_ ? 96 : 64) * newest_.size());
  append(message, std::uint32_t{1});
  append(message, static_cast<std::uint32_t>(newest_.size()));
  append(message, run_id_);
  append(message, step);
  append(message, calc_time(step));
  append(message, static_cast<double>(newest_written_ns_) * 1e-6);
  for (const auto& [id, entry] : newest_) {
    const PlantState& state = entry.truth();
    append(message, id);
    append(message, static_cast<std::uint32_t>(entry.kind()));
    append_floats(message, state.p_WQ_m());
    append_floats(message, state.q_WB());
    append_floats(message, state.p_WL_m());
    append_floats(message, find_reference(entry, true));
    append(message, calc_rotor_rate(entry));
    if (scene_) append_cable(message, state);
  }
  return message;
}

// --- rows ----------------------------------------------------------------------------------------

std::vector<const RecordEntry*> PageFrames::find_rows(std::uint32_t vehicle_id,
                                                      std::uint64_t from) const {
  std::vector<const RecordEntry*> rows;
  for (std::size_t i = 0; i < count_; ++i)
    for (const RecordEntry& entry : decoded_[i].batch.entries())
      if (entry.vehicle_id() == vehicle_id && has_state(entry) && entry.step() >= from)
        rows.push_back(&entry);
  const auto is_earlier = [](const auto* a, const auto* b) { return a->step() < b->step(); };
  const auto is_same = [](const auto* a, const auto* b) { return a->step() == b->step(); };
  std::sort(rows.begin(), rows.end(), is_earlier);
  rows.erase(std::unique(rows.begin(), rows.end(), is_same), rows.end());
  return rows;
}

/// Appends the values in the order of kColumns, then the signals.
void PageFrames::append_values(std::string& message, const RecordEntry& entry) const {
  const PlantState& state = entry.truth();
  append_floats(message, state.p_WQ_m());
  append_floats(message, state.v_WQ_m_s());
  append_floats(message, state.p_WL_m());
  append_floats(message, state.v_WL_m_s());
  append_floats(message, std::array{state.alpha_rad(), state.beta_rad(), state.alpha_dot_rad_s(),
                                    state.beta_dot_rad_s()});
  append_floats(message, entry.f_Q_W_n());
  if (has_attitude_) {
    append_floats(message, state.q_WB());
    append_floats(message, state.w_WB_B_rad_s());
  } else {
    for (int i = 0; i < 7; ++i) append(message, kNaN);
  }
  append_floats(message, find_reference(entry, false));
  for (std::size_t i = 0; i < signals_; ++i)
    append(message, i < state.signals().size() ? static_cast<float>(state.signals()[i]) : kNaN);
}

std::string PageFrames::make_rows(std::uint32_t vehicle_id) {
  const auto last = last_steps_.find(vehicle_id);
  if (last == last_steps_.end()) return {};
  const auto rows = find_rows(vehicle_id, last->second);
  if (rows.empty()) return {};
  last->second = rows.back()->step() + 1;

  const auto kept = thin(rows.size(), kMostRows);
  const std::size_t columns = kColumns.size() + signals_;
  std::string message;
  message.reserve(24 + kept.size() * (8 + 4 * columns));
  append(message, std::uint32_t{2});
  append(message, vehicle_id);
  append(message, static_cast<std::uint32_t>(kept.size()));
  append(message, static_cast<std::uint32_t>(columns));
  append(message, run_id_);
  for (const std::size_t i : kept) append(message, calc_time(rows[i]->step()));
  for (const std::size_t i : kept) append_values(message, *rows[i]);
  return message;
}

}  // namespace sls::view
