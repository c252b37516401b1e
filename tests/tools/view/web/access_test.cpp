#include "tools/view/web/access.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "common/config/config_error.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::view {
namespace {

constexpr const char* kAccessToken = "0123456789abcdef";

AccessOptions make_options(const std::string& address = "127.0.0.1") {
  AccessOptions options;
  options.address = address;
  return options;
}

bool may_look(const std::string& host, const AccessOptions& options = make_options()) {
  return judge({host, std::nullopt, std::nullopt}, options).may_look;
}

Access judge_page(const std::string& host, const std::string& origin,
                  const AccessOptions& options = make_options()) {
  return judge({host, origin, std::nullopt}, options);
}

// --- Host ----------------------------------------------------------------------------------------

TEST(AccessTest, TakesHostsOfThisMachineWithAnyPort) {
  for (const char* host :
       {"127.0.0.1:8765", "127.0.0.1", "localhost:8765", "LOCALHOST:1", "LocalHost", "[::1]:8765",
        "[::1]", "127.1.2.3:80", "[::ffff:127.0.0.1]:8765", "[0:0:0:0:0:0:0:1]"})
    EXPECT_TRUE(may_look(host)) << host;
}

TEST(AccessTest, RefusesForeignAndMalformedHosts) {
  for (const char* host : {"",
                           "localhost.evil.com",
                           "evil.com:8765",
                           "127.0.0.1.evil.com",
                           "localhost.",
                           "127.1",
                           "2130706433",
                           "0x7f000001",
                           "0.0.0.0",
                           "10.0.0.1",
                           "::1",
                           "[::1",
                           "[::1]8765",
                           "[::1]:",
                           "[127.0.0.1]",
                           "[]",
                           "localhost:",
                           "localhost:99999",
                           "localhost:-1",
                           "localhost:80:80",
                           "localhost:0x50",
                           "user@localhost",
                           "localhost/",
                           "local host",
                           "localhost\t",
                           "[::2]",
                           "[localhost]",
                           ":8765",
                           "127.0.0.1%00",
                           "\xef\xbc\x91"})
    EXPECT_FALSE(may_look(host)) << host;
}

TEST(AccessTest, TakesTheAddressListenedOn) {
  const AccessOptions options = make_options("192.168.1.5");
  EXPECT_TRUE(may_look("192.168.1.5:8765", options));
  EXPECT_FALSE(may_look("192.168.1.6:8765", options));
  EXPECT_TRUE(may_look("[FE80::1]:8765", make_options("fe80::1")));
}

TEST(AccessTest, TakesAnyIpAddressButNoNameWhereAllAreListenedOn) {
  for (const char* address : {"0.0.0.0", "::"}) {
    const AccessOptions options = make_options(address);
    EXPECT_TRUE(may_look("192.168.1.6:8765", options));
    EXPECT_TRUE(may_look("[fe80::1]:8765", options));
    EXPECT_FALSE(may_look("evil.com:8765", options));
  }
}

TEST(AccessTest, SaysWhyAHostIsRefused) {
  EXPECT_EQ(judge({"", std::nullopt, std::nullopt}, make_options()).reason,
            "expected a header Host, got none");
  EXPECT_EQ(judge({"evil.com\n", std::nullopt, std::nullopt}, make_options()).reason,
            "expected Host 127.0.0.1, localhost or a loopback address, got 'evil.com?'");
}

// --- Origin --------------------------------------------------------------------------------------

TEST(AccessTest, OwnPagesLookAndOperate) {
  for (const auto& [host, origin] : std::vector<std::pair<std::string, std::string>>{
           {"127.0.0.1:8765", "http://127.0.0.1:8765"},
           {"localhost:8765", "http://LOCALHOST:8765"},
           {"localhost:8765", "https://localhost:8765"},
           {"localhost", "http://localhost"},
           {"localhost", "https://localhost"},
           {"localhost:443", "https://localhost"},
           {"[::1]:8765", "http://[::1]:8765"}}) {
    const Access access = judge_page(host, origin);
    EXPECT_TRUE(access.may_look && access.may_operate) << host << " " << origin;
    EXPECT_EQ(access.reason, "");
  }
}

TEST(AccessTest, OtherPagesDoNotLook) {
  for (const char* origin :
       {"null", "", "http://evil.com", "http://127.0.0.1:8766", "http://127.0.0.1",
        "http://localhost:8765", "http://127.0.0.1:8765/", "http://127.0.0.1:8765.evil.com",
        "http://evil.com:8765", "127.0.0.1:8765", "://127.0.0.1:8765", "http:/127.0.0.1:8765",
        "http://user@127.0.0.1:8765", "file://", "http://127.0.0.1:8765 http://evil.com"})
    EXPECT_FALSE(judge_page("127.0.0.1:8765", origin).may_look) << origin;
}

TEST(AccessTest, AllowedPagesLookButDoNotOperateWithoutAToken) {
  AccessOptions options = make_options();
  options.allowed_origins = {"https://app.foxglove.dev", "http://127.0.0.1:3000", "file://"};
  for (const char* origin : {"https://app.foxglove.dev", "https://APP.foxglove.dev:443",
                             "http://127.0.0.1:3000", "file://"}) {
    const Access access = judge_page("127.0.0.1:8765", origin, options);
    EXPECT_TRUE(access.may_look) << origin;
    EXPECT_FALSE(access.may_operate) << origin;
    EXPECT_EQ(access.reason, "a page of --allow-origin may only look without --token-file");
  }
  for (const char* origin : {"http://app.foxglove.dev", "https://app.foxglove.dev.evil.com",
                             "https://foxglove.dev", "http://127.0.0.1:3001", "null"})
    EXPECT_FALSE(judge_page("127.0.0.1:8765", origin, options).may_look) << origin;
}

TEST(AccessTest, AllowedPagesOperateWithTheToken) {
  AccessOptions options = make_options();
  options.allowed_origins = {"https://app.foxglove.dev"};
  options.token = "0123456789abcdef";
  RequestOrigin request{"127.0.0.1:8765", "https://app.foxglove.dev", std::nullopt};
  EXPECT_EQ(judge(request, options).reason, "expected a token");
  request.token = "0123456789abcdeF";
  EXPECT_EQ(judge(request, options).reason, "wrong token");
  request.token = "0123456789abcdef";
  EXPECT_TRUE(judge(request, options).may_operate);
  request.origin = "https://evil.com";
  EXPECT_FALSE(judge(request, options).may_look);
}

// --- operating -----------------------------------------------------------------------------------

TEST(AccessTest, OperatingNeedsTheTokenWhereThereIsOne) {
  for (const char* address : {"127.0.0.1", "192.168.1.5"}) {
    AccessOptions options = make_options(address);
    options.token = kAccessToken;
    const std::string host = options.address + ":8765";
    const Access without = judge({host, std::nullopt, std::nullopt}, options);
    EXPECT_TRUE(without.may_look);
    EXPECT_FALSE(without.may_operate);
    EXPECT_EQ(without.reason, "expected a token");
    const Access wrong = judge({host, std::nullopt, "0123456789abcdeF"}, options);
    EXPECT_FALSE(wrong.may_operate);
    EXPECT_EQ(wrong.reason, "wrong token");
    EXPECT_TRUE(judge({host, std::nullopt, kAccessToken}, options).may_operate);
  }
}

TEST(AccessTest, AReadOnlyViewerAllowsNoOperation) {
  AccessOptions options = make_options();
  options.is_read_only = true;
  options.token = kAccessToken;
  const Access access = judge({"127.0.0.1:8765", std::nullopt, kAccessToken}, options);
  EXPECT_TRUE(access.may_look);
  EXPECT_FALSE(access.may_operate);
  EXPECT_EQ(access.reason, "started with --read-only");
}

TEST(AccessTest, AnotherAddressNeedsATokenToOperate) {
  EXPECT_FALSE(judge({"192.168.1.5:8765", std::nullopt, std::nullopt}, make_options("192.168.1.5"))
                   .may_operate);
}

TEST(AccessTest, ComparesTokensOfAnyLength) {
  EXPECT_TRUE(is_same_token(kAccessToken, kAccessToken));
  EXPECT_TRUE(is_same_token("", ""));
  EXPECT_FALSE(is_same_token("", kAccessToken));
  EXPECT_FALSE(is_same_token(std::string(kAccessToken) + "0", kAccessToken));
  EXPECT_FALSE(is_same_token(std::string_view("0123456789abcde\0", 16), kAccessToken));
  EXPECT_FALSE(is_same_token(std::string(1 << 20, 'x'), kAccessToken));
}

TEST(AccessTest, AfterFiveWrongTokensANetworkGetsOneTryASecond) {
  TokenTries tries;
  const TokenTries::Clock::time_point begin{};
  for (int i = 0; i < 5; ++i) {
    EXPECT_LE(tries.find_wait("10.0.0.2", begin).count(), 0) << i;
    tries.note_wrong("10.0.0.2", begin);
  }
  const std::chrono::seconds second(1);
  EXPECT_EQ(tries.find_wait("10.0.0.2", begin), second);
  EXPECT_LE(tries.find_wait("10.0.0.3", begin).count(), 0) << "another network";
  tries.note_wrong("10.0.0.2", begin + second);
  EXPECT_EQ(tries.find_wait("10.0.0.2", begin + second), second);
}

// --- options -------------------------------------------------------------------------------------

TEST(AccessTest, AnotherAddressNeedsAToken) {
  for (const char* address : {"127.0.0.1", "::1", "localhost", "127.0.0.2"})
    EXPECT_NO_THROW(check(make_options(address))) << address;
  EXPECT_EQ(test::find_error<config::ConfigError>([] { check(make_options("0.0.0.0")); }),
            "--listen: expected a loopback address, or --token-file with it, got 0.0.0.0");
  AccessOptions options = make_options("0.0.0.0");
  options.token = kAccessToken;
  EXPECT_NO_THROW(check(options));
}

TEST(AccessTest, ChecksAllowedOrigins) {
  AccessOptions options = make_options();
  for (const char* origin : {"null", "*", "", "app.foxglove.dev", "https://app.foxglove.dev/x",
                             "https://", "http://a b"}) {
    options.allowed_origins = {origin};
    EXPECT_EQ(test::find_error<config::ConfigError>([&] { check(options); }),
              "--allow-origin: expected SCHEME://HOST[:PORT], got '" + std::string(origin) + "'");
  }
}

// --- the token's file ----------------------------------------------------------------------------

class TokenFileTest : public testing::Test {
 protected:
  std::string write(const std::string& bytes, mode_t mode = 0600) {
    const std::filesystem::path file = folder_ / "token";
    test::write_bytes(file, bytes);
    ::chmod(file.c_str(), mode);
    return file;
  }
  std::string find_token_problem(const std::string& file) {
    return test::find_error<config::ConfigError>([&] { load_token(file); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(TokenFileTest, TakesTheFirstLine) {
  EXPECT_EQ(load_token(write("0123456789abcdef\nmore\n")), kAccessToken);
  EXPECT_EQ(load_token(write("0123456789abcdef\r\n", 0400)), kAccessToken);
  EXPECT_EQ(load_token(write(std::string(256, '~'))), std::string(256, '~'));
  EXPECT_EQ(load_token(write(std::string(256, '~') + "\r\n")), std::string(256, '~'));
}

TEST_F(TokenFileTest, RefusesAFileThatOthersMayRead) {
  const std::string file = write("0123456789abcdef\n", 0640);
  EXPECT_EQ(find_token_problem(file),
            "--token-file: " + file + ": expected mode 0600 or stricter, got 0640");
}

TEST_F(TokenFileTest, RefusesOtherTokens) {
  for (const std::string& bytes :
       {std::string(), std::string("\n0123456789abcdef"), std::string("0123456789abcde\n"),
        std::string("0123456789 abcdef\n"), std::string("0123456789abcdef\xc3\xa4\n"),
        std::string("0123456789abcdef\0", 17), std::string(257, 'x'), std::string(5000, 'x')}) {
    const std::string problem = find_token_problem(write(bytes));
    EXPECT_NE(problem.find("expected 16 to 256 printable characters"), std::string::npos)
        << bytes << ": " << problem;
    EXPECT_EQ(problem.find("0123456789"), std::string::npos) << "a token is secret";
  }
}

TEST_F(TokenFileTest, RefusesAPathThatIsNoFile) {
  EXPECT_NE(find_token_problem(folder_ / "none").find("No such file"), std::string::npos);
  EXPECT_NE(find_token_problem(folder_.path()).find("regular file"), std::string::npos);
  const std::string pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(find_token_problem(pipe).find("regular file"), std::string::npos);
}

}  // namespace
}  // namespace sls::view
