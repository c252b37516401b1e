#pragma once

#include <slsPubSubTypes.h>

#include <cstdint>
#include <exception>
#include <string>
#include <vector>

#include "common/bus/fastdds/bounds.hpp"
#include "common/bus/fastdds/plain_cdr.hpp"
#include "fastcdr_api.hpp"
#include "fastdds_types.hpp"

namespace sls::bus {

/// The receiver of reports on samples that a reader in this thread refuses.
class MisfitReport {
 public:
  virtual ~MisfitReport() = default;
  /// `payload` does not fit `type`, because of `defect`.
  virtual void report(const rtps::SerializedPayload_t& payload, const std::string& type,
                      const std::string& defect) = 0;
};

/// The receiver in use; null outside of a reader's `take`.
inline thread_local MisfitReport* misfit_report = nullptr;

/// Makes `report` the receiver in use while this object exists.
class MisfitScope {
 public:
  explicit MisfitScope(MisfitReport& report) { misfit_report = &report; }
  ~MisfitScope() { misfit_report = nullptr; }
  MisfitScope(const MisfitScope&) = delete;
  MisfitScope& operator=(const MisfitScope&) = delete;
};

/// Buffer for samples that a raw reader in this thread takes: their bytes with the encapsulation
/// header, not decoded. Null outside of a raw reader's `take`.
inline thread_local std::vector<std::uint8_t>* raw_target = nullptr;

/// Makes `target` the buffer in use while this object exists.
class RawScope {
 public:
  explicit RawScope(std::vector<std::uint8_t>* target) { raw_target = target; }
  ~RawScope() { raw_target = nullptr; }
  RawScope(const RawScope&) = delete;
  RawScope& operator=(const RawScope&) = delete;
};

/// A generated type support whose `deserialize` refuses malformed samples. The generated function
/// does not catch most exceptions of the serialisation library: one malformed sample from any
/// program ends the process (README.md, traps 15 and 23). It also accepts samples of another
/// type, which have bytes left over, and reads their fields in the wrong places (trap 25). It
/// accepts sequences and names beyond their bounds, too (bounds.hpp).
///
/// Upstream: Fast-CDR #144; Fast DDS 2.11 catches more, but not std::bad_alloc. To be deleted when
/// the generated function catches every exception, creates no more elements than a sample's length
/// allows and refuses left-over bytes; guarded_type_test.cpp then passes without this class.
template <class Generated>
class GuardedType : public CodedType<Generated> {
  using Message = typename Generated::type;

 protected:
  std::uint32_t find_size(const void* data) const override {
    if constexpr (plain_cdr::kIsCoded<Message>)
      return plain_cdr::calc_size(*static_cast<const Message*>(data));
    return 0;
  }

  bool write(const void* data, rtps::SerializedPayload_t& payload) const override {
    if constexpr (plain_cdr::kIsCoded<Message>)
      return plain_cdr::write(*static_cast<const Message*>(data), payload);
    return false;
  }

  bool read(rtps::SerializedPayload_t& payload, void* data) override {
    // A payload longer than any sample can claim a huge number of elements, and Fast CDR creates
    // them before it reads them.
    if (payload.length > max_size_of(*this))
      return refuse(payload, data,
                    "expected at most " + std::to_string(max_size_of(*this)) + " bytes, got " +
                        std::to_string(payload.length));
    if (raw_target) {
      raw_target->assign(payload.data, payload.data + payload.length);
      return true;
    }
    if constexpr (plain_cdr::kIsCoded<Message>)
      if (plain_cdr::read(payload, *static_cast<Message*>(data), kMostPadding)) return true;
    // The same as in the generated function, which does not return the number of bytes read.
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload.data), payload.length);
    Cdr cdr = make_cdr(buffer);
    try {
      cdr.read_encapsulation();
      payload.encapsulation = cdr.endianness() == Cdr::BIG_ENDIANNESS ? CDR_BE : CDR_LE;
      read_message(cdr, *static_cast<Message*>(data));
    } catch (const eprosima::fastcdr::exception::NotEnoughMemoryException&) {
      return refuse(payload, data, "expected more bytes, got " + std::to_string(payload.length));
    } catch (const eprosima::fastcdr::exception::Exception& error) {
      return refuse_content(payload, data, error.what());  // no std::exception since Fast CDR 2.3
    } catch (const std::exception& error) {
      return refuse_content(payload, data, error.what());
    }
    const std::size_t used = count_bytes(cdr);
    if (payload.length - used > kMostPadding)
      return refuse(
          payload, data,
          "expected " + std::to_string(used) + " bytes, got " + std::to_string(payload.length));
    const auto& message = *static_cast<const Message*>(data);
    // Fast CDR 2 accepts a sample that ends between two members. Those that are missing keep what
    // another sample said.
    if (const std::size_t needed = plain_cdr::kHeader.size() + calc_cdr_size(message, 0);
        needed > used)
      return refuse(payload, data, "expected more bytes, got " + std::to_string(payload.length));
    std::string excess = find_excess(message);
    if (excess.empty())
      excess = find_cut_name(message, {reinterpret_cast<const char*>(payload.data), payload.length},
                             cdr.endianness() != Cdr::DEFAULT_ENDIAN);
    return excess.empty() || refuse(payload, data, "expected at most " + excess);
  }

 private:
  static constexpr std::size_t kMostPadding = 3;  // to a multiple of four

  bool refuse_content(const rtps::SerializedPayload_t& payload, void* data,
                      const char* reason) const {
    return refuse(payload, data, std::string("expected plain CDR of that type, got: ") + reason);
  }

  bool refuse(const rtps::SerializedPayload_t& payload, void* data,
              const std::string& defect) const {
    // Frees the elements that the sample claimed: up to a thousand times the sample's size.
    *static_cast<Message*>(data) = Message();
    if (misfit_report) misfit_report->report(payload, name_of(*this), defect);
    return false;
  }
};

}  // namespace sls::bus
