#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // OpenSSL's

namespace sls::text {

/// Calculates a SHA-256 of data that comes in pieces.
class Sha256 {
 public:
  using Digest = std::array<unsigned char, 32>;

  Sha256();
  void add(const void* data, std::size_t size);
  void add(std::string_view bytes) { add(bytes.data(), bytes.size()); }

  /// The digest of everything added; nothing can be added after it.
  Digest finish();

 private:
  std::unique_ptr<evp_md_ctx_st, void (*)(evp_md_ctx_st*)> context_;
};

/// 64 lower-case hex digits.
std::string to_hex(const Sha256::Digest& digest);

/// SHA-256 of `bytes` as 64 lower-case hex digits.
std::string calc_sha256(std::string_view bytes);

/// SHA-256 of a file's content, read in blocks.
/// @throws std::system_error naming the file where it cannot be read.
std::string calc_file_sha256(const std::filesystem::path& file);

}  // namespace sls::text
