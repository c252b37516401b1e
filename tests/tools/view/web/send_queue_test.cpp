#include "tools/view/web/send_queue.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace sls::view {
namespace {

bool push(SendQueue& queue, const std::string& text, Delivery delivery, std::uint64_t key = 0) {
  return queue.push(MessageKind::kText, std::make_shared<std::string>(text), delivery, key);
}

std::string pop_all(SendQueue& queue) {
  std::string texts;
  while (const auto message = queue.pop()) texts += *message->payload + " ";
  return texts;
}

std::string make_text(char letter, std::size_t size = 10'000) { return std::string(size, letter); }

TEST(SendQueueTest, KeepsTheOrder) {
  SendQueue queue(100'000);
  push(queue, "a", Delivery::kAlways);
  push(queue, "b", Delivery::kDroppable);
  push(queue, "c", Delivery::kNewest, 1);
  push(queue, "d", Delivery::kAlways);
  EXPECT_EQ(queue.bytes(), 4u);
  EXPECT_EQ(pop_all(queue), "a b c d ");
  EXPECT_EQ(queue.bytes(), 0u);
  EXPECT_EQ(queue.dropped(), 0u);
}

TEST(SendQueueTest, ReplacesTheQueuedMessageOfAKeyInItsPlace) {
  SendQueue queue(100'000);
  push(queue, "a1", Delivery::kNewest, 1);
  push(queue, "b1", Delivery::kNewest, 2);
  push(queue, "a2", Delivery::kNewest, 1);
  push(queue, "longer a3", Delivery::kNewest, 1);
  EXPECT_EQ(queue.bytes(), 11u);
  EXPECT_EQ(queue.dropped(), 2u);
  EXPECT_EQ(pop_all(queue), "longer a3 b1 ");
}

TEST(SendQueueTest, DoesNotReplaceAMessageThatWasTaken) {
  SendQueue queue(100'000);
  push(queue, "a1", Delivery::kNewest, 1);
  EXPECT_EQ(*queue.pop()->payload, "a1");
  push(queue, "a2", Delivery::kNewest, 1);
  EXPECT_EQ(pop_all(queue), "a2 ");
  EXPECT_EQ(queue.dropped(), 0u);
}

TEST(SendQueueTest, DropsTheOldestDroppableMessagesFirst) {
  SendQueue queue(35'000);
  push(queue, make_text('k'), Delivery::kAlways);
  push(queue, make_text('a'), Delivery::kDroppable);
  push(queue, make_text('b'), Delivery::kDroppable);
  push(queue, make_text('c'), Delivery::kDroppable);
  EXPECT_EQ(queue.dropped(), 1u);
  EXPECT_TRUE(push(queue, make_text('l'), Delivery::kAlways));
  EXPECT_EQ(queue.dropped(), 2u);
  EXPECT_EQ(pop_all(queue), make_text('k') + " " + make_text('c') + " " + make_text('l') + " ");
}

TEST(SendQueueTest, RefusesAMessageThatMustArriveWhereThereIsNoRoom) {
  SendQueue queue(25'000);
  EXPECT_TRUE(push(queue, make_text('a'), Delivery::kAlways));
  EXPECT_TRUE(push(queue, make_text('b'), Delivery::kAlways));
  EXPECT_TRUE(push(queue, make_text('c'), Delivery::kNewest, 1)) << "left out";
  EXPECT_TRUE(push(queue, make_text('d'), Delivery::kDroppable)) << "left out";
  EXPECT_EQ(queue.dropped(), 2u);
  EXPECT_FALSE(push(queue, make_text('e'), Delivery::kAlways));
}

TEST(SendQueueTest, AMessageLargerThanTheQueueDropsNoOther) {
  SendQueue queue(25'000);
  push(queue, make_text('a'), Delivery::kDroppable);
  push(queue, make_text('b', 30'000), Delivery::kDroppable);
  EXPECT_EQ(pop_all(queue), make_text('a') + " ");
}

TEST(SendQueueTest, KeepsTheOldMessageOfAKeyWhereTheNewOneDoesNotFit) {
  SendQueue queue(25'000);
  push(queue, make_text('a'), Delivery::kNewest, 1);
  push(queue, make_text('b'), Delivery::kAlways);
  push(queue, make_text('c', 20'000), Delivery::kNewest, 1);
  EXPECT_EQ(pop_all(queue), make_text('a') + " " + make_text('b') + " ");
}

TEST(SendQueueTest, EmptyMessagesTakeRoom) {
  SendQueue queue(100'000);
  int taken = 0;
  while (push(queue, "", Delivery::kAlways)) ASSERT_LT(++taken, 10'000);
}

TEST(SendQueueTest, NeverExceedsItsCapacity) {
  constexpr std::size_t kCapacity = 50'000;
  std::mt19937 random(1);
  SendQueue queue(kCapacity);
  std::size_t bytes = 0;
  for (int i = 0; i < 100'000; ++i) {
    const auto delivery = static_cast<Delivery>(random() % 3);
    if (random() % 3 > 0) {
      push(queue, make_text('x', random() % 4'000), delivery, random() % 5);
    } else if (const auto message = queue.pop()) {
      ASSERT_LT(message->payload->size(), 4'000u);
    }
    ASSERT_LE(queue.bytes(), kCapacity);
  }
  while (const auto message = queue.pop()) bytes += message->payload->size();
  EXPECT_LE(bytes, kCapacity);
  EXPECT_EQ(queue.bytes(), 0u);
}

}  // namespace
}  // namespace sls::view
