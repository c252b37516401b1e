/// Plain CDR of the three topics of every step, States, Commands and RecordBatch: the same bytes as
/// those of the generated code, in half the time for Fast CDR 1 and a seventh for Fast CDR 2
/// (docs/results.md, "Speed").
///
/// Upstream: none reported. To be deleted when the generated code is as fast.
#pragma once

#include <sls.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "fastdds_api.hpp"

namespace sls::bus::plain_cdr {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "samples are written in little endian");

/// The encapsulation header of plain CDR in little endian; its last two bytes are options.
inline constexpr std::array<std::uint8_t, 4> kHeader = {0, 1, 0, 0};

// --- Fields, in the order of idl/sls.idl. `Message` is const where samples are written. ----------

template <class Message, class Type>
using If = std::enable_if_t<std::is_same_v<std::remove_const_t<Message>, Type>>;

template <class Coder, class Message>
If<Message, ControllerState> visit(Coder& coder, Message& message) {
  coder(message.stage_index());
  coder(message.stage_start_step());
  coder(message.numbers(), MOST_NUMBERS);
}
template <class Coder, class Message>
If<Message, PlantState> visit(Coder& coder, Message& message) {
  coder.doubles(message.p_WQ_m(), message.v_WQ_m_s(), message.q_WB(), message.w_WB_B_rad_s(),
                message.p_WL_m(), message.v_WL_m_s(), message.alpha_rad(), message.beta_rad(),
                message.alpha_dot_rad_s(), message.beta_dot_rad_s());
  coder(message.signals(), MOST_NUMBERS);
}
template <class Coder, class Message>
If<Message, VehicleState> visit(Coder& coder, Message& message) {
  coder(message.vehicle_id());
  visit(coder, message.measured());
  coder.doubles(message.f_Q_W_n());
  coder(message.force_origin());
  coder(message.controller_name());
  visit(coder, message.controller());
}
template <class Coder, class Message>
If<Message, States> visit(Coder& coder, Message& message) {
  coder(message.run_id());
  coder(message.step());
  coder(message.sim_time_ns());
  coder(message.vehicles(), SAMPLE_VEHICLES);
}
template <class Coder, class Message>
If<Message, Reference> visit(Coder& coder, Message& message) {
  coder(message.stage_index());
  coder(message.stage_name());
  coder.doubles(message.position_m(), message.velocity_m_s(), message.acceleration_m_s2(),
                message.jerk_m_s3(), message.snap_m_s4());
}
template <class Coder, class Message>
If<Message, ControlCommand> visit(Coder& coder, Message& message) {
  coder(message.vehicle_id());
  coder.doubles(message.f_Q_W_n());
  visit(coder, message.reference());
  visit(coder, message.controller());
  coder(message.mission());
  coder(message.fault());
  coder(message.compute_time_ns());
}
template <class Coder, class Message>
If<Message, Commands> visit(Coder& coder, Message& message) {
  coder(message.run_id());
  coder(message.step());
  coder(message.client_name());
  coder(message.strength());
  coder(message.vehicles(), SAMPLE_VEHICLES);
}
template <class Coder, class Message>
If<Message, RecordEntry> visit(Coder& coder, Message& message) {
  coder(message.vehicle_id());
  coder(message.step());
  coder(message.kind());
  visit(coder, message.truth());
  coder(message.measured(), 1);
  coder.doubles(message.f_Q_W_n());
  coder(message.answered_step());
  coder(message.client_name());
  visit(coder, message.answer());
}
template <class Coder, class Message>
If<Message, RecordBatch> visit(Coder& coder, Message& message) {
  coder(message.run_id());
  coder(message.batch_index());
  coder(message.is_last());
  coder(message.entries(), BATCH_ENTRIES);
}

/// True of the messages that this file codes.
template <class Message>
inline constexpr bool kIsCoded =
    std::is_same_v<Message, States> || std::is_same_v<Message, Commands> ||
    std::is_same_v<Message, RecordBatch>;

// --- Coders --------------------------------------------------------------------------------------

/// Number of bytes up to the next multiple of `alignment`, a power of two.
constexpr std::size_t calc_padding(std::size_t offset, std::size_t alignment) {
  return (0 - offset) & (alignment - 1);
}

template <class Type>
inline constexpr bool kIsDoubles = std::is_same_v<Type, double>;
template <std::size_t kCount>
inline constexpr bool kIsDoubles<std::array<double, kCount>> = true;

/// Writes fields as long as they fit into `room` bytes, and counts the bytes of all.
class Writer {
 public:
  Writer(std::uint8_t* data, std::size_t room) : data_(data), room_(room) {}
  std::size_t size() const { return size_; }

  template <class Number>
  std::enable_if_t<std::is_arithmetic_v<Number>> operator()(const Number& number) {
    write(&number, sizeof number, sizeof number);
  }
  template <class Enum>
  std::enable_if_t<std::is_enum_v<Enum>> operator()(const Enum& value) {
    static_assert(sizeof value == 4, "an enumeration of the contract has four bytes");
    write(&value, 4, 4);
  }
  /// Numbers and arrays of them: there is padding only before the first.
  template <class... Doubles>
  void doubles(const Doubles&... fields) {
    static_assert((kIsDoubles<Doubles> && ...));
    std::uint8_t* place = make_room((sizeof fields + ...), 8);
    if (!place) return;
    ((std::memcpy(place, &fields, sizeof fields), place += sizeof fields), ...);
  }
  template <std::size_t kMost>
  void operator()(const FixedString<kMost>& text) {
    const auto length = static_cast<std::uint32_t>(std::strlen(text.c_str()) + 1);
    (*this)(length);
    write(text.c_str(), length, 1);
  }
  void operator()(const std::vector<double>& numbers, std::size_t) {
    (*this)(static_cast<std::uint32_t>(numbers.size()));
    if (!numbers.empty()) write(numbers.data(), 8 * numbers.size(), 8);
  }
  template <class Element>
  void operator()(const std::vector<Element>& elements, std::size_t) {
    (*this)(static_cast<std::uint32_t>(elements.size()));
    for (const Element& element : elements) visit(*this, element);
  }

 private:
  void write(const void* from, std::size_t bytes, std::size_t alignment) {
    if (std::uint8_t* const place = make_room(bytes, alignment)) std::memcpy(place, from, bytes);
  }
  /// The place of the next `bytes` bytes; null if they do not fit.
  std::uint8_t* make_room(std::size_t bytes, std::size_t alignment) {
    const std::size_t begin = size_, padding = calc_padding(begin, alignment);
    size_ += padding + bytes;
    if (size_ > room_) return nullptr;
    if (padding != 0) std::memset(data_ + begin, 0, padding);
    return data_ + begin + padding;
  }

  std::uint8_t* const data_;
  const std::size_t room_;
  std::size_t size_ = 0;
};

/// Reads fields; after the first that does not fit the contract it reads nothing more.
class Reader {
 public:
  Reader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool is_good() const { return is_good_; }
  std::size_t rest() const { return size_ - at_; }

  template <class Number>
  std::enable_if_t<std::is_arithmetic_v<Number>> operator()(Number& number) {
    read(&number, sizeof number, sizeof number);
  }
  void operator()(bool& flag) {
    std::uint8_t byte = 0;
    (*this)(byte);
    is_good_ = is_good_ && byte <= 1;
    flag = byte != 0;
  }
  template <class Enum>
  std::enable_if_t<std::is_enum_v<Enum>> operator()(Enum& value) {
    read(&value, 4, 4);
  }
  template <class... Doubles>
  void doubles(Doubles&... fields) {
    static_assert((kIsDoubles<Doubles> && ...));
    const std::uint8_t* place = take((sizeof fields + ...), 8);
    if (!place) return;
    ((std::memcpy(&fields, place, sizeof fields), place += sizeof fields), ...);
  }
  template <std::size_t kMost>
  void operator()(FixedString<kMost>& text) {
    std::uint32_t length = 0;
    (*this)(length);
    const auto* const begin = reinterpret_cast<const char*>(data_) + at_;
    is_good_ = is_good_ && length > 0 && length <= kMost + 1 && length <= rest() &&
               std::memchr(begin, 0, length) == begin + length - 1;
    if (!is_good_) return;
    text = begin;
    at_ += length;
  }
  void operator()(std::vector<double>& numbers, std::size_t most) {
    resize(numbers, most);
    if (!numbers.empty()) read(numbers.data(), 8 * numbers.size(), 8);
  }
  template <class Element>
  void operator()(std::vector<Element>& elements, std::size_t most) {
    resize(elements, most);
    for (Element& element : elements) visit(*this, element);
  }

 private:
  /// Gives `sequence` the length that follows, or none if it is more than `most`.
  template <class Sequence>
  void resize(Sequence& sequence, std::size_t most) {
    std::uint32_t length = 0;
    (*this)(length);
    is_good_ = is_good_ && length <= most;
    sequence.resize(is_good_ ? length : 0);
  }
  void read(void* to, std::size_t bytes, std::size_t alignment) {
    if (const std::uint8_t* const place = take(bytes, alignment)) std::memcpy(to, place, bytes);
  }
  /// The place of the next `bytes` bytes; null if they are not there.
  const std::uint8_t* take(std::size_t bytes, std::size_t alignment) {
    const std::size_t padding = calc_padding(at_, alignment);
    is_good_ = is_good_ && padding + bytes <= rest();
    if (!is_good_) return nullptr;
    at_ += padding + bytes;
    return data_ + at_ - bytes;
  }

  const std::uint8_t* const data_;
  const std::size_t size_;
  std::size_t at_ = 0;
  bool is_good_ = true;
};

// --- Samples -------------------------------------------------------------------------------------

/// Bytes of a sample, with the encapsulation header.
template <class Message>
std::uint32_t calc_size(const Message& message) {
  Writer writer(nullptr, 0);
  visit(writer, message);
  return static_cast<std::uint32_t>(kHeader.size() + writer.size());
}

/// False if `payload` has too little room.
template <class Message>
bool write(const Message& message, rtps::SerializedPayload_t& payload) {
  if (payload.max_size < kHeader.size()) return false;
  const std::size_t room = payload.max_size - kHeader.size();
  std::memcpy(payload.data, kHeader.data(), kHeader.size());
  Writer writer(payload.data + kHeader.size(), room);
  visit(writer, message);
  if (writer.size() > room) return false;
  payload.encapsulation = CDR_LE;
  payload.length = static_cast<std::uint32_t>(kHeader.size() + writer.size());
  return true;
}

/// False, with `message` in any state, if `payload` is not exactly a sample of the contract in
/// little endian, apart from at most `most_padding` bytes at its end.
template <class Message>
bool read(rtps::SerializedPayload_t& payload, Message& message, std::size_t most_padding) {
  if (payload.length < kHeader.size() || payload.data[0] != kHeader[0] ||
      payload.data[1] != kHeader[1])
    return false;
  Reader reader(payload.data + kHeader.size(), payload.length - kHeader.size());
  visit(reader, message);
  if (!reader.is_good() || reader.rest() > most_padding) return false;
  payload.encapsulation = CDR_LE;
  return true;
}

}  // namespace sls::bus::plain_cdr
