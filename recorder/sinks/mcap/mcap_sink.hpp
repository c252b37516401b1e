#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/ros/mirrors.hpp"
#include "recorder/sinks/mcap/entry_message.hpp"
#include "recorder/sinks/mcap/mcap_file.hpp"
#include "recorder/sinks/record_sink.hpp"

namespace sls::record {

/// sls.mcap: one message per step and vehicle, with the data of the CSV files only; and standard
/// ROS 2 messages that mirror them, at most 100 times per simulated second. Equal rows and
/// parameters give the same bytes. Status samples are not in it.
class McapSink : public RecordSink {
 public:
  static constexpr const char* kFile = "sls.mcap";
  static constexpr std::size_t kFlushBytes = 1 << 17;

  /// Creates `file`. Of the parameters it uses scenario, contract, vehicles, signals and period.
  McapSink(const std::filesystem::path& file, const Parameters& parameters,
           WriteCall write = system_write());

  void add(const StepRows& rows) override;
  void add(const SimStatus&) override {}
  bool is_full() const override { return file_.pending_bytes() >= kFlushBytes; }
  /// Flushes full chunks only. The last chunk waits until it is full, so no byte depends on wall
  /// time.
  void flush() override { file_.flush(); }
  std::map<std::string, std::string> list_versions() const override;
  std::vector<RecordedFile> finish() override;

  std::uint64_t messages() const { return file_.messages(); }

 private:
  struct Vehicle {
    std::uint16_t channel = 0;
    std::int64_t mirrored_slot = -1;  // the last mirror period with a mirrored step
  };

  void add_channels();
  void add_attachments(const Parameters& parameters);
  void mirror(const StepRows& rows, std::int64_t time_ns);
  void write_mirror(std::size_t channel, std::int64_t time_ns,
                    const std::vector<std::uint8_t>& message);

  const std::int64_t period_ns_;
  McapFile file_;
  EntryMessage message_;
  ros::Mirrors mirrors_;
  const ros::Mirrors::Emit emit_;
  std::map<std::uint32_t, Vehicle> vehicles_;
  std::vector<std::uint16_t> mirror_channels_;  // ids in the file of the mirrors' channels
};

}  // namespace sls::record
