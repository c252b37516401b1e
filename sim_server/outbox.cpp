#include "sim_server/outbox.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <utility>

#include "common/app/awake_clock.hpp"
#include "common/app/log.hpp"
#include "common/app/scheduling.hpp"
#include "common/bus/spinning.hpp"

namespace sls::sim {

void Outbox::begin_run(const config::Sync& sync, std::uint64_t run_id) {
  is_realtime_ = sync.mode == config::SyncMode::kRealtime;
  // Threads may be refused: then the earlier run still has what it needs to report that.
  auto records = std::make_unique<RecordStream>(endpoints_.records,
                                                endpoints_.domain.max_batch_bytes(), run_id);
  // In real time the loop must wait for no reader.
  endpoints_.states.begin_run(run_id, sync.period_ns, is_realtime_);
  records_ = std::move(records);
}

void Outbox::put(Item item) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(item));
  is_waiting_ = true;
}

void Outbox::write_waiting() {
  std::unique_lock lock(mutex_);
  while (!waiting_.empty()) {
    const Item item = std::move(waiting_.front());
    waiting_.pop_front();
    is_waiting_ = !waiting_.empty();  // also if this item cannot be written
    lock.unlock();
    std::visit([this](const auto& content) { write(content); }, item);
    lock.lock();
  }
}

void Outbox::write(const sync::Line& line) { app::log(line); }

Moment Outbox::send_states(const Fleet& fleet) {
  const Moment moment{app::awake_clock().now(), std::chrono::system_clock::now(),
                      app::awake_clock().stopped()};
  endpoints_.states.write(fleet, [](std::size_t) { return true; });
  return moment;
}

void Outbox::resend_states(const Fleet& fleet, const std::function<bool(std::size_t)>& is_wanted) {
  endpoints_.states.write(fleet, is_wanted);
}

void Outbox::record_step(const Fleet& fleet) { records_->add_step(fleet.records()); }

void Outbox::record_late(const Vehicle& vehicle, const OfferedAnswer& offered) {
  records_->add_step({make_late_record(vehicle, offered)});
}

void Outbox::show_progress(std::string text) {
  if (::isatty(STDERR_FILENO) != 0) log({false, std::move(text)});
}

void Outbox::begin_flight() {
  if (!is_realtime_) return bus::start_spinning();
  if (!app::put_process_first())
    log({false,
         "real-time priority refused (needs root, CAP_SYS_NICE or RLIMIT_RTPRIO): steps may be "
         "late"});
}

}  // namespace sls::sim
