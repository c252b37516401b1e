/// Replaces the server's thread: the test's thread runs the posted tasks while it waits.
#pragma once

#include <functional>

#include "common/app/mailbox.hpp"
#include "tests/support/waiting.hpp"
#include "tools/view/live/feed.hpp"

namespace sls::test {

class ServerThread {
 public:
  view::Feed::Post post() {
    return [this](std::function<void()> task) { tasks_.put(std::move(task)); };
  }

  std::size_t run_all() {
    auto tasks = tasks_.take_all();
    for (auto& task : tasks) task();
    return tasks.size();
  }

  bool wait_until(const std::function<bool()>& is_met) {
    return test::wait_until([&] {
      run_all();
      return is_met();
    });
  }

 private:
  app::Mailbox<std::function<void()>> tasks_{100'000};
};

}  // namespace sls::test
