/// Writes one MCAP file (https://mcap.dev/spec): schemas, channels and attachments first, then
/// messages in compressed chunks with their indexes, at the end the summary. The limits of chunks
/// depend only on the messages, so the same calls give the same bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "recorder/byte_buffer.hpp"
#include "recorder/sinks/growing_file.hpp"

namespace sls::record {

/// The compression of the chunks; another version of the library can give other bytes.
struct Compression {
  const char* library;  ///< "zstd"
  std::string version;
  int level;
};
Compression describe_compression();

/// Every member that writes @throws std::system_error with the name of the file if it cannot be
/// written. Earlier whole records remain in the file and can be read.
class McapFile {
 public:
  /// Creates `file`, which must not exist.
  explicit McapFile(const std::filesystem::path& file, WriteCall write = system_write());
  ~McapFile();
  McapFile(const McapFile&) = delete;
  McapFile& operator=(const McapFile&) = delete;

  /// Ids count from 1. Call this before the first message.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view text);
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic,
                            std::string_view message_encoding);
  /// The attachment's log and create times are 0.
  void add_attachment(std::string_view name, std::string_view media_type, std::string_view bytes);

  /// Log and publish time are `time_ns`.
  void add_message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                   std::string_view bytes);

  /// Bytes that a flush would write.
  std::size_t pending_bytes() const { return out_.bytes().size(); }
  /// Passes the records before the messages, and every full chunk, to the operating system.
  void flush();

  /// Writes the last chunk and the summary. Nothing may be added afterwards.
  void finish();

  std::uint64_t messages() const { return message_count_; }
  const std::filesystem::path& path() const { return file_.path(); }

 private:
  struct MessageIndex {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> entries;  // time and place in the chunk
    std::uint64_t messages = 0;                                    // in the whole file
  };
  struct ChunkIndex {
    std::uint64_t first_time = 0, last_time = 0;
    std::uint64_t begin = 0, size = 0;                             // its record in the file
    std::vector<std::pair<std::uint16_t, std::uint64_t>> indexes;  // channel, place in the file
    std::uint64_t indexes_size = 0, compressed_size = 0, size_before = 0;
  };
  struct AttachmentIndex {
    std::uint64_t begin = 0, size = 0, bytes = 0;
    std::string name, media_type;
  };

  void write_chunk();
  void write_message_indexes(ChunkIndex& chunk);
  void write_summary();
  void append_chunk_index(const ChunkIndex& chunk);
  void append_attachment_index(const AttachmentIndex& attachment);
  void append_statistics();
  void begin_record(std::uint8_t opcode);
  void end_record();

  GrowingFile file_;
  std::uint64_t written_ = 0;  // bytes in the file
  std::uint32_t crc_ = 0;      // of these bytes
  ByteBuffer out_;             // records that are not written yet
  std::size_t record_ = 0;     // begin of the current record in out_
  struct Compressor;
  const std::unique_ptr<Compressor> compressor_;

  ByteBuffer schemas_, channels_;  // their records, which the summary repeats
  std::uint16_t schema_count_ = 0;
  std::vector<MessageIndex> channel_indexes_;  // by channel id, from 1
  std::vector<AttachmentIndex> attachments_;
  std::vector<ChunkIndex> chunks_;

  ByteBuffer chunk_;  // messages that wait for their chunk
  std::uint64_t chunk_first_time_ = 0, chunk_last_time_ = 0;
  std::uint64_t message_count_ = 0, first_time_ = 0, last_time_ = 0;
};

}  // namespace sls::record
