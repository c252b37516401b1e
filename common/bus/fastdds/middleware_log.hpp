#pragma once

#include <fastdds/dds/log/Log.hpp>

#include <functional>
#include <string>

namespace sls::bus {

/// The log of Fast DDS: warnings and errors go to our log on stderr (by itself it prints to stdout,
/// which is for data). The first error since `clear()` is kept: it names the cause where those that
/// follow only say what failed because of it.
///
/// Upstream: #4873, the log goes to stderr from 3.0 on. To be deleted when, besides, the functions
/// that create entities and load profiles return the reason of a failure (none reported).
class MiddlewareLog : public eprosima::fastdds::dds::LogConsumer {
 public:
  /// Takes the log of this process over. Warnings too are wanted of a secured participant: only
  /// they say why a certificate is refused.
  static void start(bool with_warnings);

  void Consume(const eprosima::fastdds::dds::Log::Entry& entry) override;

  /// Returns when everything logged so far has been consumed.
  static void flush();

  static void clear() { find_first_error(); }

  /// The first error since the last call of this or of `clear()`.
  static std::string find_first_error();
};

/// A message of Fast DDS without the place in its source, and without a line's end.
std::string trim_place(const std::string& message);

}  // namespace sls::bus
