// Also a test for ThreadSanitizer: producers and consumer share only the mailbox.
#include "common/app/mailbox.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace sls::app {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

Clock::time_point soon() { return Clock::now() + 10s; }

TEST(MailboxTest, HandsItemsOutInTheOrderTheyCameIn) {
  Mailbox<int> mailbox(100);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(mailbox.put(i));
  for (int i = 0; i < 100; ++i) EXPECT_EQ(mailbox.take(soon()), i);
  EXPECT_EQ(mailbox.refused(), 0u);
}

TEST(MailboxTest, RefusesAndCountsItemsThatDoNotFit) {
  Mailbox<int> mailbox(2);
  EXPECT_TRUE(mailbox.put(1));
  EXPECT_TRUE(mailbox.put(2));
  EXPECT_FALSE(mailbox.put(3));
  EXPECT_FALSE(mailbox.put(4));
  EXPECT_EQ(mailbox.refused(), 2u);
  EXPECT_EQ(mailbox.take(soon()), 1);
  EXPECT_TRUE(mailbox.put(5));
  EXPECT_EQ(mailbox.take(soon()), 2);
  EXPECT_EQ(mailbox.take(soon()), 5);
  EXPECT_EQ(mailbox.refused(), 2u);
}

TEST(MailboxTest, AMailboxWithoutRoomRefusesEverything) {
  Mailbox<int> mailbox(0);
  EXPECT_FALSE(mailbox.put(1));
  EXPECT_EQ(mailbox.refused(), 1u);
  EXPECT_EQ(mailbox.take(Clock::now()), std::nullopt);
}

TEST(MailboxTest, GivesUpAtTheDeadlineAndNotBefore) {
  Mailbox<int> mailbox(1);
  const auto deadline = Clock::now() + 30ms;
  EXPECT_EQ(mailbox.take(deadline), std::nullopt);
  EXPECT_GE(Clock::now(), deadline);
}

TEST(MailboxTest, APastDeadlineStillReturnsAvailableItems) {
  Mailbox<int> mailbox(1);
  EXPECT_EQ(mailbox.take(Clock::now() - 1h), std::nullopt);
  mailbox.put(7);
  EXPECT_EQ(mailbox.take(Clock::now() - 1h), 7);
}

TEST(MailboxTest, PuttingWakesTheOneThatWaits) {
  Mailbox<int> mailbox(1);
  const auto began = Clock::now();
  std::thread producer([&] { mailbox.put(1); });
  EXPECT_EQ(mailbox.take(began + 60s), 1);
  EXPECT_LT(Clock::now() - began, 30s);
  producer.join();
}

TEST(MailboxTest, TakesItemsThatCanOnlyBeMoved) {
  Mailbox<std::unique_ptr<int>> mailbox(1);
  mailbox.put(std::make_unique<int>(3));
  const auto item = mailbox.take(soon());
  ASSERT_TRUE(item);
  EXPECT_EQ(**item, 3);
}

TEST(MailboxTest, AllItemsCanBeTakenAtOnceWithoutWaiting) {
  Mailbox<int> mailbox(3);
  EXPECT_TRUE(mailbox.take_all().empty());
  for (int i = 0; i < 3; ++i) mailbox.put(i);
  EXPECT_EQ(mailbox.take_all(), (std::deque<int>{0, 1, 2}));
  EXPECT_TRUE(mailbox.take_all().empty());
  EXPECT_TRUE(mailbox.put(3)) << "there is room again";
  EXPECT_EQ(mailbox.take(soon()), 3);
}

TEST(MailboxTest, AnInterruptEndsTheWaitThatIsThereOrTheNextOne) {
  Mailbox<int> mailbox(4);
  mailbox.interrupt();
  EXPECT_TRUE(mailbox.wait(Clock::time_point::max()));  // returns at once
  EXPECT_TRUE(mailbox.is_empty());

  std::thread interrupting([&] { mailbox.interrupt(); });
  EXPECT_TRUE(mailbox.wait(Clock::time_point::max()));
  interrupting.join();

  const auto deadline = Clock::now() + std::chrono::milliseconds(20);
  EXPECT_FALSE(mailbox.wait(deadline));  // no interrupt is left
  EXPECT_GE(Clock::now(), deadline);
}

TEST(MailboxTest, AnItemEndsTheWaitToo) {
  Mailbox<int> mailbox(4);
  mailbox.put(7);
  EXPECT_FALSE(mailbox.is_empty());
  EXPECT_TRUE(mailbox.wait(Clock::time_point::max()));
  EXPECT_EQ(mailbox.take(soon()), 7);
}

TEST(MailboxTest, ItemsOfManyProducersAreNotLostDoubledOrReordered) {
  constexpr int kProducers = 8, kItems = 2000;
  struct Item {
    int producer;
    int number;
  };
  Mailbox<Item> mailbox(64);  // small, so often full
  std::atomic<std::uint64_t> refusals{0};
  std::vector<std::thread> producers;
  for (int producer = 0; producer < kProducers; ++producer)
    producers.emplace_back([&, producer] {
      for (int number = 0; number < kItems; ++number)
        while (!mailbox.put({producer, number})) {
          ++refusals;
          std::this_thread::yield();
        }
    });
  std::vector<int> next(kProducers, 0);
  const auto check = [&](const Item& item) {
    EXPECT_EQ(item.number, next[static_cast<std::size_t>(item.producer)]++);
  };
  for (int taken = 0; taken < kProducers * kItems; ++taken) {
    const auto item = mailbox.take(soon());
    ASSERT_TRUE(item);
    check(*item);
    if (taken % 10 != 0) continue;
    for (const Item& another : mailbox.take_all()) {
      check(another);
      ++taken;
    }
  }
  for (auto& producer : producers) producer.join();
  EXPECT_EQ(mailbox.take(Clock::now()), std::nullopt);
  EXPECT_EQ(mailbox.refused(), refusals);
}

}  // namespace
}  // namespace sls::app
