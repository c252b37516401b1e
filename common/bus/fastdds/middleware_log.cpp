#include "common/bus/fastdds/middleware_log.hpp"

#include <spdlog/spdlog.h>

#include <mutex>
#include <utility>

#include "common/bus/fastdds/refusals.hpp"

namespace sls::bus {
namespace {

namespace dds = eprosima::fastdds::dds;

std::mutex& mutex() {
  static auto& instance = *new std::mutex;  // the middleware may still log while we exit
  return instance;
}

std::string& first_error() {
  static auto& instance = *new std::string;
  return instance;
}

}  // namespace

void MiddlewareLog::start(bool with_warnings) {
  dds::Log::SetVerbosity(with_warnings ? dds::Log::Kind::Warning : dds::Log::Kind::Error);
  dds::Log::ClearConsumers();
  dds::Log::RegisterConsumer(std::make_unique<MiddlewareLog>());
  clear();
}

void MiddlewareLog::Consume(const dds::Log::Entry& entry) {
  if (entry.kind == dds::Log::Kind::Info || entry.message.empty()) return;
  spdlog::debug("Fast DDS: {}", entry.message);
  const std::string category = entry.context.category ? entry.context.category : "";
  if (category == "SECURITY" || category == "SECURITY_AUTHENTICATION")
    Refusals::of_process().note_cause(entry.message);
  if (entry.kind != dds::Log::Kind::Error) return;
  const std::lock_guard lock(mutex());
  if (first_error().empty()) first_error() = entry.message;
}

void MiddlewareLog::flush() { dds::Log::Flush(); }

std::string MiddlewareLog::find_first_error() {
  flush();
  const std::lock_guard lock(mutex());
  return std::exchange(first_error(), {});
}

std::string trim_place(const std::string& message) {
  // "sls/state topic not found in allow rule. (./src/cpp/…/Permissions.cpp:1133)"; the folder
  // before src/ depends on who built the library.
  const std::size_t source = message.find("/src/cpp/");
  std::string text =
      message.substr(0, source == message.npos ? source : message.rfind(" (", source));
  while (!text.empty() && (text.back() == '\n' || text.back() == '.' || text.back() == ' '))
    text.pop_back();
  return text;
}

}  // namespace sls::bus
