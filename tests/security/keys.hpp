/// Keys as `./sls keys` makes them, and as intruders have them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/system/process.hpp"

namespace sls::test {

/// Runs a command to its end, and returns what it printed.
/// @throws std::runtime_error with that if it fails.
std::string run(const std::vector<std::string>& command);

/// `./sls keys` with these arguments, as a command.
std::vector<std::string> make_keys_command(const std::vector<std::string>& arguments);

/// A folder of keys, made by `./sls keys`, that is gone with this object.
class Keys {
 public:
  Keys() { run(make_keys_command({path().string()})); }

  std::filesystem::path path() const { return folder_ / "keys"; }

  /// Command prefix that makes a program use `identity` of these keys, put before its command line;
  /// its role's by default.
  std::vector<std::string> as(const std::string& identity = {}) const;

  /// One more identity in a folder of that name.
  void add(const std::string& role, const std::string& name) const;
  /// The same, expired 12 hours ago. A clock that is 18 hours behind takes it.
  void add_expired(const std::string& role, const std::string& name) const;
  /// A recorder that gives itself the controller's permissions, signed with its own key, in a
  /// folder of that name. It has its middleware trust them, too.
  void add_usurper(const std::string& name) const;
  /// Gives a role the topics of contract 1 in place of sls/record, signed as they should be.
  void make_contract_1(const std::string& role) const;

 private:
  TemporaryFolder folder_;
};

}  // namespace sls::test
