#include "tools/view/web/request_text.hpp"

#include <gtest/gtest.h>

namespace sls::view {
namespace {

TEST(RequestTextTest, SplitsATarget) {
  EXPECT_EQ(parse_target("/")->path, "/");
  EXPECT_EQ(parse_target("/recording/0?x=1")->path, "/recording/0");
  EXPECT_FALSE(parse_target("/?")->token);
  EXPECT_FALSE(parse_target("/?token")->token);
  EXPECT_FALSE(parse_target("/?tokens=a&atoken=b")->token);
  EXPECT_EQ(parse_target("/?token=")->token, "");
  EXPECT_EQ(parse_target("/?a=1&token=abc&token=def")->token, "abc");
  EXPECT_EQ(parse_target("/?token=a%2Bb%26%3d+c")->token, "a+b&=+c");
}

TEST(RequestTextTest, RefusesOtherTargets) {
  for (const char* target : {"", "*", "http://127.0.0.1/", "127.0.0.1:80", "x", "/?token=%",
                             "/?token=%1", "/?token=%zz", "/?token=%+1", "/?token=%-1"})
    EXPECT_FALSE(parse_target(target)) << target;
}

TEST(RequestTextTest, LeavesPathsAsTheyCame) {
  EXPECT_EQ(parse_target("/%2e%2e/etc/passwd")->path, "/%2e%2e/etc/passwd");
  EXPECT_EQ(parse_target("/../x")->path, "/../x");
}

TEST(RequestTextTest, QuotesInOneShortLine) {
  EXPECT_EQ(quote("a\r\nb\x7f\xc3"), "a??b??");
  EXPECT_EQ(quote(std::string(100, 'x')), std::string(80, 'x') + "...");
}

}  // namespace
}  // namespace sls::view
