/// ./sls keys, and the error messages of the programs for wrong keys.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>

#include "tests/security/keys.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

/// Runs `command`, expects it to fail with `code` and one line, and returns this line.
std::string fail(const Words& command, int code) {
  const std::string output = expect_exit(command, code);
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  return output;
}

std::string fail_keys(const Words& arguments) { return fail(make_keys_command(arguments), 2); }

Words list(const fs::path& folder) {
  Words names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

TEST(KeysTest, GiveEachRoleAFolderOfItsOwn) {
  const Keys keys;
  const Words expected = {"certificate.pem", "governance.p7s",  "identity_ca.pem",
                          "key.pem",         "permissions.p7s", "permissions_ca.pem"};
  EXPECT_EQ(list(keys.path()),
            (Words{"ca", "controller", "operator", "recorder", "server", "viewer"}));
  for (const char* role : {"controller", "operator", "recorder", "server", "viewer"}) {
    EXPECT_EQ(list(keys.path() / role), expected);
    struct stat status;
    ASSERT_EQ(stat((keys.path() / role / "key.pem").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u) << role;
  }
  EXPECT_EQ(list(keys.path().parent_path()), Words{"keys"});
}

TEST(KeysTest, AreNotReplacedUnlessAskedTo) {
  const Keys keys;
  const std::string certificate = read_bytes(keys.path() / "server/certificate.pem");
  EXPECT_TRUE(holds(fail_keys({keys.path().string()}), "--force replaces it"));
  EXPECT_EQ(read_bytes(keys.path() / "server/certificate.pem"), certificate);
  expect_exit(make_keys_command({keys.path().string(), "--force"}));
  EXPECT_NE(read_bytes(keys.path() / "server/certificate.pem"), certificate);
  EXPECT_EQ(list(keys.path().parent_path()), Words{"keys"});
}

TEST(KeysTest, NeverReplaceAnotherFolder) {
  const TemporaryFolder folder;
  write_bytes(folder / "thesis.tex", "important");
  EXPECT_TRUE(holds(fail_keys({folder.path().string(), "--force"}), "which --force leaves alone"));
  EXPECT_EQ(list(folder.path()), Words{"thesis.tex"});
}

TEST(KeysTest, MistakesAreOneLine) {
  const TemporaryFolder folder;
  const std::string keys = (folder / "keys").string();
  EXPECT_TRUE(holds(fail_keys({}), "expected a folder"));
  EXPECT_TRUE(holds(fail_keys({keys, "--days", "0"}), "expected 1 to 36500, got '0'"));
  EXPECT_TRUE(holds(fail_keys({keys, "--add", "pilot", "a"}), "expected a role"));
  EXPECT_TRUE(holds(fail_keys({keys, "--add", "controller", "../a"}), "expected a name"));
  EXPECT_TRUE(holds(fail_keys({keys, "--add", "controller", "a"}), "identity_ca.key"));
  EXPECT_TRUE(list(folder.path()).empty());
}

/// Programs with a mistake in their keys: exit code 2, and one line.
class BadKeysTest : public testing::Test {
 protected:
  static void expect_refused(const Words& before, const std::string& cause) {
    const std::string output = fail(
        before + make_command("sim_server", 0, {"--scenario", scenario("short")}, qos("secure")),
        2);
    EXPECT_TRUE(holds(output, cause)) << output;
  }
  fs::path file(const std::string& name) const { return keys_.path() / "server" / name; }

  Keys keys_;
};

TEST_F(BadKeysTest, NoFolderAtAll) {
  expect_refused({"env", "-u", "SLS_KEYS"}, "${SLS_KEYS}: expected");
}

TEST_F(BadKeysTest, AMissingFile) {
  for (const std::string& name : list(keys_.path() / "server")) {
    fs::rename(file(name), file("hidden"));
    expect_refused(keys_.as(), file(name).string() +
                                   ": expected a file that ./sls keys made, got no such file");
    fs::rename(file("hidden"), file(name));
  }
}

TEST_F(BadKeysTest, AFileThatIsSomethingElse) {
  for (const std::string& name : list(keys_.path() / "server")) {
    const std::string content = read_bytes(file(name));
    write_bytes(file(name), "something else\n");
    expect_refused(keys_.as(), file(name).string() + ": expected ");
    fs::resize_file(file(name), std::uintmax_t{1} << 40);
    expect_refused(keys_.as(), file(name).string() + ": expected at most 1048576 bytes, got ");
    write_bytes(file(name), content);
  }
}

TEST_F(BadKeysTest, AnEncryptedKeyAsksForNoPassword) {
  expect_exit({"openssl", "ec", "-aes256", "-passout", "pass:secret", "-in", file("key.pem"),
               "-out", file("key.pem")});
  expect_refused(keys_.as(), "sim_server: error: " + file("key.pem").string() +
                                 ": expected a private key (PEM) without a password, got ");
}

TEST_F(BadKeysTest, AFileOfOtherKeys) {
  const Keys others;
  const auto expect_message = [&](const std::string& name, const std::string& place,
                                  const std::string& message) {
    const std::string content = read_bytes(file(name));
    write_bytes(file(name), read_bytes(others.path() / "server" / name));
    expect_refused(keys_.as(), file(place).string() + ": expected " + message);
    write_bytes(file(name), content);
  };
  expect_message("key.pem", "key.pem", "the private key of");
  expect_message("certificate.pem", "certificate.pem",
                 "a certificate that is valid now and signed");
  expect_message("identity_ca.pem", "certificate.pem",
                 "a certificate that is valid now and signed");
  expect_message("permissions_ca.pem", "governance.p7s", "a document signed by");
  expect_message("governance.p7s", "governance.p7s", "a document signed by");
  expect_message("permissions.p7s", "permissions.p7s", "a document signed by");
}

TEST_F(BadKeysTest, PermissionsOfSomebodyElse) {
  write_bytes(file("permissions.p7s"), read_bytes(keys_.path() / "operator/permissions.p7s"));
  expect_refused(keys_.as(), "expected permissions for CN=server,OU=server,O=SLS, got none");
}

TEST_F(BadKeysTest, AKeyThatOthersMayRead) {
  fs::permissions(file("key.pem"), fs::perms::others_read, fs::perm_options::add);
  expect_refused(keys_.as(),
                 file("key.pem").string() + ": expected mode 0600 or stricter, got 0604");
}

TEST_F(BadKeysTest, KeysThatEndSoonAreNamedAtTheStart) {
  const auto start = [&](const std::string& identity) {
    return expect_exit(
        keys_.as(identity) +
            make_command("sim_ctl", own_domain(), {"status", "--timeout-s", "1"}, qos("secure")),
        1);
  };
  expect_exit(
      make_keys_command({keys_.path().string(), "--add", "operator", "soon", "--days", "29"}));
  EXPECT_TRUE(
      holds(start("soon"), "soon/certificate.pem: expected more than 30 days of validity, got 2"));
  EXPECT_FALSE(holds(start("operator"), "validity"));
}

TEST_F(BadKeysTest, ExpiredOnes) {
  keys_.add_expired("server", "old");
  expect_refused(keys_.as("old"), "got: certificate has expired");
}

}  // namespace
}  // namespace sls::test
