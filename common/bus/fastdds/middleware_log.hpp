#pragma once

#include <fastdds/dds/log/Log.hpp>

#include <string>

namespace sls::bus {

/// Sends warnings and errors of Fast DDS to our log on stderr. Fast DDS itself prints them to
/// stdout, which is for data. Keeps the first error since `clear()`: it names the cause, the errors
/// after it only name the consequences.
///
/// Upstream: #4873, the log goes to stderr from 3.0 on. To be deleted when also the functions that
/// create entities and load profiles return the reason of a failure (none reported).
class MiddlewareLog : public eprosima::fastdds::dds::LogConsumer {
 public:
  /// Takes over the log of this process. A secured participant requires warnings, too: only they
  /// contain the reason why a certificate is refused.
  static void start(bool with_warnings);

  void Consume(const eprosima::fastdds::dds::Log::Entry& entry) override;

  /// Returns when everything logged so far has been consumed.
  static void flush();

  static void clear() { find_first_error(); }

  /// The first error since the last call of this function or of `clear()`.
  static std::string find_first_error();
};

/// A message of Fast DDS without the place in its source and without a line end.
std::string trim_place(const std::string& message);

}  // namespace sls::bus
