#include "sim_server/worker_pool.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

TEST(WorkerPoolTest, EveryItemIsProcessedOnceByAnyNumberOfThreads) {
  for (const std::size_t threads : {1, 2, 3, 8}) {
    WorkerPool pool(threads);
    for (const std::size_t count : {0, 1, 2, 7, 1000}) {
      std::vector<int> done(count, 0);
      pool.for_each(count, [&](std::size_t i) { ++done[i]; });
      EXPECT_EQ(done, std::vector<int>(count, 1)) << threads << " threads";
    }
  }
}

TEST(WorkerPoolTest, WritesOfOneCallAreVisibleToTheNext) {
  WorkerPool pool(4);
  std::vector<std::uint64_t> values(100, 1);
  for (int round = 0; round < 1000; ++round)
    pool.for_each(values.size(), [&](std::size_t i) { values[i] = values[i] * 3 + i; });
  std::vector<std::uint64_t> expected(100, 1);
  for (int round = 0; round < 1000; ++round)
    for (std::size_t i = 0; i < expected.size(); ++i) expected[i] = expected[i] * 3 + i;
  EXPECT_EQ(values, expected);
}

TEST(WorkerPoolTest, TheErrorOfTheLowestItemIsThrownAfterAllHaveEnded) {
  WorkerPool pool(3);
  std::atomic<int> calls{0};
  const auto fail_from_four_on = [&](std::size_t i) {
    ++calls;
    if (i >= 4) throw std::runtime_error(std::to_string(i));
  };
  EXPECT_EQ(test::find_error<std::runtime_error>([&] { pool.for_each(9, fail_from_four_on); }),
            "4");
  EXPECT_EQ(calls, 9);
  pool.for_each(3, [&](std::size_t) { ++calls; });  // the pool still works
  EXPECT_EQ(calls, 12);
}

TEST(WorkerPoolTest, AThreadThatHasDoneItsShareHelpsTheOthers) {
  WorkerPool pool(2);
  std::atomic<int> others{0};
  // The first item waits for all others, including those of its own share.
  pool.for_each(8, [&](std::size_t i) {
    if (i > 0) ++others;
    while (i == 0 && others < 7) std::this_thread::yield();
  });
  EXPECT_EQ(others, 7);
}

}  // namespace
}  // namespace sls::sim
