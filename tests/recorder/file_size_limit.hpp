#pragma once

#include <sys/resource.h>

#include <csignal>

namespace sls::record::test {

/// Limits the files of this process to `bytes`. Ignores SIGXFSZ, which would end the process.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &earlier_);
    const rlimit limit = {bytes, earlier_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &earlier_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit earlier_{};
  void (*handler_)(int) = nullptr;
};

}  // namespace sls::record::test
