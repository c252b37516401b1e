#include "common/text/sha256.hpp"

#include <gtest/gtest.h>

#include "common/config/scenario.hpp"
#include "tests/common/config/support.hpp"
#include "tests/support/errors.hpp"

namespace sls::text {
namespace {

// Source: NIST, FIPS 180-2 appendix B and the example values published with it.
TEST(Sha256Test, AgreesWithPublishedVectors) {
  EXPECT_EQ(calc_sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(calc_sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(calc_sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(calc_sha256(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256Test, PiecesGiveTheHashOfTheWhole) {
  for (const std::size_t piece : {1u, 3u, 64u, 1000u}) {
    Sha256 hash;
    const std::string whole(1'000'000, 'a');
    for (std::size_t at = 0; at < whole.size(); at += piece)
      hash.add(std::string_view(whole).substr(at, piece));
    EXPECT_EQ(to_hex(hash.finish()),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  }
}

TEST(Sha256Test, ScenarioCarriesTheHashOfItsFilesBytes) {
  for (const auto& file : config::test::list_yaml_files("config/scenarios")) {
    const config::Scenario scenario = config::load_scenario(file);
    EXPECT_EQ(scenario.text, test::read_bytes(file));
    EXPECT_EQ(scenario.sha256, calc_file_sha256(file));
  }
}

TEST(Sha256Test, MissingFileIsNamed) {
  const std::string error =
      test::find_error<std::system_error>([] { calc_file_sha256("/nowhere/nothing.yaml"); });
  EXPECT_NE(error.find("/nowhere/nothing.yaml"), error.npos) << error;
}

}  // namespace
}  // namespace sls::text
