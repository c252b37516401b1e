#include "recorder/sinks/mcap/mcap_file.hpp"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <utility>

namespace sls::record {
namespace {

constexpr std::string_view kMagic = "\x89MCAP0\r\n";
constexpr std::string_view kCompression = "zstd";
// Measurements with other levels: README.md.
constexpr int kLevel = 3;
/// Size of a full chunk before compression. A killed recorder can lose this many bytes.
constexpr std::size_t kChunkBytes = 1 << 20;

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kSummaryOffset = 0x0e,
  kDataEnd
};

constexpr std::size_t kOpcodeBytes = 1, kLengthBytes = 8;

/// CRC of `bytes` that follow those with the CRC `before`.
std::uint32_t calc_crc32(std::string_view bytes, std::uint32_t before = 0) {
  const auto* const data = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<std::uint32_t>(crc32_z(before, data, bytes.size()));
}

}  // namespace

Compression describe_compression() { return {"zstd", ZSTD_versionString(), kLevel}; }

/// Keeps its memory from one chunk to the next.
struct McapFile::Compressor {
  Compressor() : context(ZSTD_createCCtx()) {
    if (context == nullptr) throw std::bad_alloc();
    ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, kLevel);
  }
  ~Compressor() { ZSTD_freeCCtx(context); }

  std::string_view compress(std::string_view bytes) {
    result.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size =
        ZSTD_compress2(context, result.data(), result.size(), bytes.data(), bytes.size());
    if (ZSTD_isError(size) != 0)
      throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
    return {result.data(), size};
  }

  ZSTD_CCtx* const context;
  std::vector<char> result;
};

McapFile::McapFile(const std::filesystem::path& file, WriteCall write)
    : file_(file, std::move(write)), compressor_(std::make_unique<Compressor>()) {
  out_.append_raw(kMagic);
  begin_record(kHeader);
  out_.append(std::string_view());  // profile: none
  out_.append(std::string_view("sls"));
  end_record();
}

McapFile::~McapFile() = default;

// --- records -------------------------------------------------------------------------------------

void McapFile::begin_record(std::uint8_t opcode) {
  out_.make_room(0);
  record_ = out_.bytes().size();
  out_.append(opcode);
  out_.append(std::uint64_t{0});  // length; end_record sets it
}

void McapFile::end_record() {
  const std::size_t content = record_ + kOpcodeBytes + kLengthBytes;
  out_.replace(record_ + kOpcodeBytes, std::uint64_t{out_.bytes().size() - content});
}

void McapFile::flush() {
  const std::string_view bytes = out_.bytes();
  file_.append(bytes, [](std::size_t) { return std::size_t{0}; });
  crc_ = calc_crc32(bytes, crc_);
  written_ += bytes.size();
  out_.clear();
}

// --- before the messages -------------------------------------------------------------------------

std::uint16_t McapFile::add_schema(std::string_view name, std::string_view encoding,
                                   std::string_view text) {
  begin_record(kSchema);
  out_.append(++schema_count_);
  out_.append(name);
  out_.append(encoding);
  out_.append(text);
  end_record();
  schemas_.append_raw(out_.bytes().substr(record_));
  return schema_count_;
}

std::uint16_t McapFile::add_channel(std::uint16_t schema, std::string_view topic,
                                    std::string_view message_encoding) {
  channel_indexes_.emplace_back();
  const auto id = static_cast<std::uint16_t>(channel_indexes_.size());
  begin_record(kChannel);
  out_.append(id);
  out_.append(schema);
  out_.append(topic);
  out_.append(message_encoding);
  out_.append(std::uint32_t{0});  // metadata: none
  end_record();
  channels_.append_raw(out_.bytes().substr(record_));
  return id;
}

void McapFile::add_attachment(std::string_view name, std::string_view media_type,
                              std::string_view bytes) {
  begin_record(kAttachment);
  const std::size_t content = out_.bytes().size();
  out_.append(std::uint64_t{0});  // log time
  out_.append(std::uint64_t{0});  // create time
  out_.append(name);
  out_.append(media_type);
  out_.append(std::uint64_t{bytes.size()});
  out_.append_raw(bytes);
  out_.append(calc_crc32(out_.bytes().substr(content)));
  end_record();
  attachments_.push_back({written_ + record_, out_.bytes().size() - record_, bytes.size(),
                          std::string(name), std::string(media_type)});
}

// --- messages ------------------------------------------------------------------------------------

void McapFile::add_message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                           std::string_view bytes) {
  const bool is_first = chunk_.bytes().empty();
  chunk_first_time_ = is_first ? time_ns : std::min(chunk_first_time_, time_ns);
  chunk_last_time_ = is_first ? time_ns : std::max(chunk_last_time_, time_ns);
  MessageIndex& index = channel_indexes_.at(channel - 1u);
  index.entries.emplace_back(time_ns, chunk_.bytes().size());
  ++index.messages;
  ++message_count_;

  chunk_.make_room(0);
  chunk_.append(static_cast<std::uint8_t>(kMessage));
  chunk_.append(
      std::uint64_t{sizeof channel + sizeof sequence + 2 * sizeof time_ns + bytes.size()});
  chunk_.append(channel);
  chunk_.append(sequence);
  chunk_.append(time_ns);  // log time
  chunk_.append(time_ns);  // publish time
  chunk_.append_raw(bytes);
  if (chunk_.bytes().size() >= kChunkBytes) write_chunk();
}

void McapFile::write_chunk() {
  const std::string_view messages = chunk_.bytes();
  if (messages.empty()) return;
  const bool is_first = chunks_.empty();
  first_time_ = is_first ? chunk_first_time_ : std::min(first_time_, chunk_first_time_);
  last_time_ = is_first ? chunk_last_time_ : std::max(last_time_, chunk_last_time_);
  ChunkIndex chunk;
  chunk.first_time = chunk_first_time_;
  chunk.last_time = chunk_last_time_;
  const std::size_t begin = out_.bytes().size();
  chunk.begin = written_ + begin;
  chunk.size_before = messages.size();
  const std::string_view compressed = compressor_->compress(messages);
  chunk.compressed_size = compressed.size();
  begin_record(kChunk);
  out_.append(chunk.first_time);
  out_.append(chunk.last_time);
  out_.append(chunk.size_before);
  out_.append(calc_crc32(messages));
  out_.append(kCompression);
  out_.append(chunk.compressed_size);
  out_.append_raw(compressed);
  end_record();
  chunk.size = out_.bytes().size() - begin;
  write_message_indexes(chunk);
  chunks_.push_back(std::move(chunk));
  chunk_.clear();
}

void McapFile::write_message_indexes(ChunkIndex& chunk) {
  const std::size_t begin = out_.bytes().size();
  for (std::size_t i = 0; i < channel_indexes_.size(); ++i) {
    auto& entries = channel_indexes_[i].entries;
    if (entries.empty()) continue;
    const auto id = static_cast<std::uint16_t>(i + 1);
    chunk.indexes.emplace_back(id, written_ + out_.bytes().size());
    begin_record(kMessageIndex);
    out_.append(id);
    out_.append(static_cast<std::uint32_t>(entries.size() * 2 * sizeof(std::uint64_t)));
    out_.make_room(entries.size() * 2 * sizeof(std::uint64_t));
    for (const auto& [time, place] : entries) {
      out_.append(time);
      out_.append(place);
    }
    end_record();
    entries.clear();
  }
  chunk.indexes_size = out_.bytes().size() - begin;
}

// --- the end -------------------------------------------------------------------------------------

void McapFile::finish() {
  write_chunk();
  flush();
  begin_record(kDataEnd);
  out_.append(crc_);
  end_record();
  flush();
  write_summary();
}

void McapFile::write_summary() {
  const std::uint64_t begin = written_;
  struct Group {
    Opcode opcode;
    std::uint64_t begin, end;
  };
  std::vector<Group> groups;
  const auto add_group = [&](Opcode opcode, const auto& append_records) {
    const std::uint64_t from = written_ + out_.bytes().size();
    append_records();
    if (written_ + out_.bytes().size() > from)
      groups.push_back({opcode, from, written_ + out_.bytes().size()});
  };
  add_group(kSchema, [&] { out_.append_raw(schemas_.bytes()); });
  add_group(kChannel, [&] { out_.append_raw(channels_.bytes()); });
  add_group(kStatistics, [&] { append_statistics(); });
  add_group(kChunkIndex, [&] {
    for (const ChunkIndex& chunk : chunks_) append_chunk_index(chunk);
  });
  add_group(kAttachmentIndex, [&] {
    for (const AttachmentIndex& attachment : attachments_) append_attachment_index(attachment);
  });
  const std::uint64_t offsets_begin = written_ + out_.bytes().size();
  for (const Group& group : groups) {
    begin_record(kSummaryOffset);
    out_.append(static_cast<std::uint8_t>(group.opcode));
    out_.append(group.begin);
    out_.append(group.end - group.begin);
    end_record();
  }
  out_.append(static_cast<std::uint8_t>(kFooter));
  out_.append(std::uint64_t{2 * sizeof(std::uint64_t) + sizeof(std::uint32_t)});
  out_.append(begin);
  out_.append(offsets_begin);
  out_.append(calc_crc32(out_.bytes()));  // of the summary, and of the footer up to here
  out_.append_raw(kMagic);
  flush();
}

void McapFile::append_statistics() {
  begin_record(kStatistics);
  out_.append(message_count_);
  out_.append(schema_count_);
  out_.append(static_cast<std::uint32_t>(channel_indexes_.size()));
  out_.append(static_cast<std::uint32_t>(attachments_.size()));
  out_.append(std::uint32_t{0});  // metadata records
  out_.append(static_cast<std::uint32_t>(chunks_.size()));
  out_.append(first_time_);
  out_.append(last_time_);
  constexpr std::size_t kEntryBytes = sizeof(std::uint16_t) + sizeof(std::uint64_t);
  out_.append(static_cast<std::uint32_t>(channel_indexes_.size() * kEntryBytes));
  out_.make_room(channel_indexes_.size() * kEntryBytes);
  for (std::size_t i = 0; i < channel_indexes_.size(); ++i) {
    out_.append(static_cast<std::uint16_t>(i + 1));
    out_.append(channel_indexes_[i].messages);
  }
  end_record();
}

void McapFile::append_chunk_index(const ChunkIndex& chunk) {
  begin_record(kChunkIndex);
  out_.append(chunk.first_time);
  out_.append(chunk.last_time);
  out_.append(chunk.begin);
  out_.append(chunk.size);
  constexpr std::size_t kEntryBytes = sizeof(std::uint16_t) + sizeof(std::uint64_t);
  out_.append(static_cast<std::uint32_t>(chunk.indexes.size() * kEntryBytes));
  out_.make_room(chunk.indexes.size() * kEntryBytes);
  for (const auto& [channel, place] : chunk.indexes) {
    out_.append(channel);
    out_.append(place);
  }
  out_.append(chunk.indexes_size);
  out_.append(kCompression);
  out_.append(chunk.compressed_size);
  out_.append(chunk.size_before);
  end_record();
}

void McapFile::append_attachment_index(const AttachmentIndex& attachment) {
  begin_record(kAttachmentIndex);
  out_.append(attachment.begin);
  out_.append(attachment.size);
  out_.append(std::uint64_t{0});  // log time
  out_.append(std::uint64_t{0});  // create time
  out_.append(attachment.bytes);
  out_.append(attachment.name);
  out_.append(attachment.media_type);
  end_record();
}

}  // namespace sls::record
