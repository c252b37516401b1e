/// News of discovery about participants and endpoints, in the same form for each version of Fast
/// DDS.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/fastdds/endpoint_facts.hpp"
#include "fastdds_api.hpp"

namespace sls::bus {

/// Properties that our participants announce, because discovery does not tell them in each version:
/// the version of Fast DDS; the build, if it has shared memory (host_id.hpp); the process
/// (Refusals::name_process); and of a secured participant, the subjects of its certificate and of
/// its authority.
inline constexpr const char* kVersionProperty = "sls.fastdds";
inline constexpr const char* kMemoryProperty = "sls.memory";
inline constexpr const char* kProcessProperty = "sls.process";
inline constexpr const char* kCertificateProperty = "sls.certificate";
inline constexpr const char* kAuthorityProperty = "sls.authority";

/// A participant that was discovered, changed or left.
struct ParticipantNews {
  enum class Kind { kNew, kChanged, kGone };
  Kind kind = Kind::kNew;
  rtps::GUID_t guid;
  std::string name;
  rtps::VendorId_t vendor{};
  std::map<std::string, std::string> properties;
  std::vector<rtps::Locator_t> discovery_addresses;  ///< where it receives discovery data
  std::vector<rtps::Locator_t> addresses;            ///< where it receives samples
  /// The identity that a secured participant announces.
  struct Identity {
    std::string certificate, authority;  ///< subjects, in RFC 2253 order; empty if not announced
  };
  std::optional<Identity> identity;
  /// False if nothing tells whether the participant has an identity.
  bool is_identity_known = true;
};

/// An endpoint that was discovered, changed or left.
struct EndpointNews {
  bool is_gone = false;
  rtps::GUID_t guid;
  EndpointFacts facts;
  std::uint32_t max_size = 0;  ///< of a writer's samples in bytes; 0: not announced
};

}  // namespace sls::bus
