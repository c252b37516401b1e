/// Keys made by `./sls keys`, and keys of intruders.
#pragma once

#include <filesystem>
#include <string>

#include "tests/system/process.hpp"

namespace sls::test {

/// `./sls keys` with these arguments, as a command.
Words make_keys_command(const Words& arguments);

/// A folder of keys, made by `./sls keys`. The destructor removes it.
class Keys {
 public:
  Keys() { expect_exit(make_keys_command({path().string()})); }

  std::filesystem::path path() const { return folder_ / "keys"; }

  /// Command prefix that makes a program use `identity` of these keys, by default the identity of
  /// the program's role.
  Words as(const std::string& identity = {}) const;

  /// Adds an identity in a folder of that name.
  void add(const std::string& role, const std::string& name) const;
  /// Adds an identity that expired 12 hours ago. With a clock 18 hours slow it is valid.
  void add_expired(const std::string& role, const std::string& name) const;
  /// Adds a recorder with the controller's permissions, signed with its own key, in a folder of
  /// that name. Its own Fast DDS trusts this signature.
  void add_usurper(const std::string& name) const;

 private:
  TemporaryFolder folder_;
};

}  // namespace sls::test
