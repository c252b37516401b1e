/// Calls of Fast CDR 1 and of the code that is generated for it; fastcdr2/ has the same for Fast
/// CDR 2. CMake chooses.
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <cstddef>

namespace sls::bus {

using eprosima::fastcdr::Cdr;

/// A coder of plain CDR, as the contract has it.
inline Cdr make_cdr(eprosima::fastcdr::FastBuffer& buffer,
                    Cdr::Endianness endianness = Cdr::DEFAULT_ENDIAN) {
  return Cdr(buffer, endianness, Cdr::DDS_CDR);
}

/// Bytes read or written, with the encapsulation header.
inline std::size_t count_bytes(const Cdr& cdr) { return cdr.getSerializedDataLength(); }

/// See common/bus/message_size.hpp.
template <class Message>
std::size_t calc_cdr_size(const Message& message, std::size_t before) {
  return Message::getCdrSerializedSize(message, before);
}

template <class Message>
void write_message(const Message& message, Cdr& cdr) {
  message.serialize(cdr);
}

template <class Message>
void read_message(Cdr& cdr, Message& message) {
  message.deserialize(cdr);
}

}  // namespace sls::bus
