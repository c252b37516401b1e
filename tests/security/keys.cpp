#include "tests/security/keys.hpp"

namespace sls::test {
namespace {

namespace fs = std::filesystem;

std::string replace_all(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != text.npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

}  // namespace

Words make_keys_command(const Words& arguments) {
  return Words{SLS_SOURCE_DIR "/sls", "keys"} + arguments;
}

Words Keys::as(const std::string& identity) const {
  Words before = {"env", "SLS_KEYS=" + path().string()};
  if (!identity.empty()) before.push_back("SLS_IDENTITY=" + identity);
  return before;
}

void Keys::add(const std::string& role, const std::string& name) const {
  expect_exit(make_keys_command({path().string(), "--add", role, name}));
}

void Keys::add_expired(const std::string& role, const std::string& name) const {
  // Makes keys for one day with a `date` that is 36 hours slow. The authorities are valid from
  // yesterday.
  const TemporaryFolder programs;
  write_bytes(programs / "date",
              "#!/bin/sh\n[ \"$1\" = +%s ] && exec /bin/date -d '36 hours ago' +%s\n"
              "exec /bin/date \"$@\"\n");
  fs::permissions(programs / "date", fs::perms::owner_all);
  expect_exit(Words{"env", "PATH=" + programs.path().string() + ":/usr/bin:/bin"} +
              make_keys_command({path().string(), "--add", role, name, "--days", "1"}));
}

void Keys::add_usurper(const std::string& name) const {
  const fs::path own = path() / name, recorder = path() / "recorder";
  fs::copy(recorder, own);
  const TemporaryFolder work;
  expect_exit({"openssl", "smime", "-verify", "-text", "-noverify", "-in",
               (path() / "controller/permissions.p7s").string(), "-out",
               (work / "plain.xml").string()});
  write_bytes(work / "wanted.xml",
              replace_all(read_bytes(work / "plain.xml"), "CN=controller,OU=controller",
                          "CN=recorder,OU=recorder"));
  expect_exit({"openssl", "smime", "-sign", "-text", "-in", (work / "wanted.xml").string(), "-out",
               (own / "permissions.p7s").string(), "-signer",
               (recorder / "certificate.pem").string(), "-inkey", (recorder / "key.pem").string()});
  // The identity authority issued its own certificate: if it trusts both authorities (2.9) or that
  // certificate (3.1), it accepts its own signature.
  write_bytes(own / "permissions_ca.pem", read_bytes(recorder / "permissions_ca.pem") +
                                              read_bytes(recorder / "identity_ca.pem") +
                                              read_bytes(recorder / "certificate.pem"));
}

}  // namespace sls::test
