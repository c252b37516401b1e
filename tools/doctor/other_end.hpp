/// A second doctor on this machine, which answers the first: the other end of every path.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

namespace sls::doctor {

class OtherEnd {
 public:
  /// Starts this program again, with `--answer`.
  OtherEnd(const std::filesystem::path& qos_file, int domain, const std::string& identity);
  ~OtherEnd();  // ends it
  OtherEnd(const OtherEnd&) = delete;
  OtherEnd& operator=(const OtherEnd&) = delete;

  /// How it ended early, such as "signal 7 (Bus error)"; empty while it runs.
  std::string find_end();

 private:
  pid_t id_ = -1;
  std::string end_;
};

}  // namespace sls::doctor
