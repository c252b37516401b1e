#pragma once

#include <filesystem>
#include <string>

namespace sls::bus {

struct SecurityFiles {
  bool is_secured = false;  ///< `profiles` has properties of DDS Security
  /// One line if a certificate or the permissions end within 30 days: FILE, when, what then.
  std::string expiry;
};

/// Checks the files that the DDS Security properties in `profiles` name, because Fast DDS 2.9.1
/// only reports "initialization error". `profiles` is a QoS file that `read_qos_file` has
/// completed.
/// - Every file is readable.
/// - The certificate is valid now and signed by the identity authority; the key belongs to it.
/// - Only its owner may read the key.
/// - The permissions authority has signed governance and permissions.
/// - The permissions are for this certificate and valid now.
/// @throws config::ConfigError `FILE: expected …, got …`.
SecurityFiles check_security_files(const std::string& profiles);

/// Subjects of a certificate and of the authority's, in RFC 2253 order.
struct IdentityNames {
  std::string certificate, authority;
};

/// @throws config::ConfigError if one of the files cannot be read or holds no certificate.
IdentityNames find_identity_names(const std::filesystem::path& certificate,
                                  const std::filesystem::path& authority);

/// True if a signed governance document protects submessages, as keys made with `--other-vendors`
/// do (fastdds/README.md, trap 28).
bool are_submessages_protected(const std::filesystem::path& governance);

}  // namespace sls::bus
