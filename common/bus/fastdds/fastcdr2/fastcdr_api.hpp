/// Calls of Fast CDR 2 and of the code that is generated for it; fastcdr1/ has the same for Fast
/// CDR 1. CMake chooses.
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/CdrSizeCalculator.hpp>
#include <fastcdr/FastBuffer.h>

#include <cstddef>

namespace sls::bus {

using eprosima::fastcdr::Cdr;

/// A coder of plain CDR, as the contract has it.
inline Cdr make_cdr(eprosima::fastcdr::FastBuffer& buffer,
                    Cdr::Endianness endianness = Cdr::DEFAULT_ENDIAN) {
  return Cdr(buffer, endianness, eprosima::fastcdr::CdrVersion::XCDRv1);
}

/// Bytes read or written, with the encapsulation header.
inline std::size_t count_bytes(const Cdr& cdr) { return cdr.get_serialized_data_length(); }

/// See common/bus/message_size.hpp.
template <class Message>
std::size_t calc_cdr_size(const Message& message, std::size_t before) {
  eprosima::fastcdr::CdrSizeCalculator calculator(eprosima::fastcdr::CdrVersion::XCDRv1);
  return calculator.calculate_serialized_size(message, before);
}

template <class Message>
void write_message(const Message& message, Cdr& cdr) {
  cdr << message;
}

template <class Message>
void read_message(Cdr& cdr, Message& message) {
  cdr >> message;
}

}  // namespace sls::bus
