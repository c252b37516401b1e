#include "common/bus/queued_writer.hpp"

#include <gtest/gtest.h>

#include <mutex>
#include <vector>

#include "tests/support/own_domain.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using sls::test::own_domain;
using sls::test::wait_until;

const std::filesystem::path kQosFile = SLS_SOURCE_DIR "/config/qos/default.xml";
constexpr std::uint64_t kRun = 700;

TEST(QueuedWriterTest, WritesInOrderAndEmptiesItsQueueWhenItEnds) {
  Node near(kQosFile, own_domain(), "near"), far(kQosFile, own_domain(), "far");
  std::mutex mutex;
  std::vector<std::uint64_t> indices;
  Reader<RecordBatch> reader(far, kRecordReaderProfile,
                             [&](const RecordBatch& batch, const PeerId&) {
                               const std::lock_guard lock(mutex);
                               if (batch.run_id() == kRun) indices.push_back(batch.batch_index());
                             });
  Writer<RecordBatch> writer(near);
  ASSERT_TRUE(wait_until([&] { return writer.matched().count(far.id()) > 0; }));
  constexpr std::uint64_t kCount = 500;
  {
    QueuedWriter<RecordBatch> queue(writer, kCount);
    RecordBatch batch;
    batch.run_id(kRun);
    for (std::uint64_t index = 0; index < kCount; ++index) {
      batch.batch_index(index);
      queue.write(batch);
    }
    EXPECT_EQ(queue.lost(), 0u);
  }
  ASSERT_TRUE(wait_until([&] {
    const std::lock_guard lock(mutex);
    return indices.size() == kCount;
  }));
  for (std::uint64_t index = 0; index < kCount; ++index) EXPECT_EQ(indices[index], index);
}

TEST(QueuedWriterTest, MessagesThatDoNotFitAreCountedAndNeverBlock) {
  Node node(kQosFile, own_domain(), "near");
  Writer<RecordBatch> writer(node);
  QueuedWriter<RecordBatch> queue(writer, 0);  // room for nothing
  for (int i = 0; i < 10; ++i) queue.write(RecordBatch());
  EXPECT_EQ(queue.lost(), 10u);
}

}  // namespace
}  // namespace sls::bus
