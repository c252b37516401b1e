#include "tools/view/replay/export.hpp"

#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <zlib.h>

#include <system_error>

#include "common/config/config_error.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/tools/view/replay/packed_run.hpp"
#include "tools/view/replay/recorded_run.hpp"

namespace sls::view {
namespace {

namespace fs = std::filesystem;
using sls::test::read_bytes;
using sls::test::write_bytes;

const std::string kPage =
    "<!DOCTYPE html><html><head></head><body><main></main>"
    "<script type=\"application/json\" id=\"sls-mode\">{\"mode\":\"live\"}</script>"
    "<script>run()</script></body></html>\n";

std::string zip(const std::string& text) {
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string bytes(text.size() + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  deflate(&stream, Z_FINISH);
  bytes.resize(stream.total_out);
  deflateEnd(&stream);
  return bytes;
}

/// The bytes of data block `index` of the page, decoded with OpenSSL.
std::string read_block(const std::string& html, int index) {
  const std::string begin = "<script type=\"application/octet-stream;base64\" id=\"sls-recording-" +
                            std::to_string(index) + "\">";
  const auto from = html.find(begin);
  if (from == html.npos) return "none";
  const auto to = html.find("</script>", from);
  const std::string text = html.substr(from + begin.size(), to - from - begin.size());
  std::string bytes(text.size() / 4 * 3, '\0');
  EXPECT_GE(EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                            reinterpret_cast<const unsigned char*>(text.data()),
                            static_cast<int>(text.size())),
            0);
  if (!text.empty()) bytes.resize(bytes.size() - (text.size() - text.find_last_not_of('=') - 1));
  return bytes;
}

TEST(ExportTest, BytesOfAnyLengthAndValueComeBackFromTheBlocks) {
  std::string bytes;
  for (int i = 0; i < 260; ++i) {
    const std::string html = make_export(kPage, {bytes, "second"});
    EXPECT_EQ(read_block(html, 0), bytes);
    EXPECT_EQ(read_block(html, 1), "second");
    bytes += static_cast<char>(i);
  }
}

TEST(ExportTest, ThePageLearnsItsModeAndKeepsTheRest) {
  const std::string html = make_export(kPage, {"a", "b"});
  EXPECT_NE(html.find("id=\"sls-mode\">{\"mode\":\"embedded\",\"recordings\":[\"#sls-recording-0\","
                      "\"#sls-recording-1\"]}</script><script>run()</script>"),
            std::string::npos);
  EXPECT_LT(html.find("id=\"sls-recording-1\">"), html.find("id=\"sls-mode\""));
  EXPECT_EQ(html.find("\"live\""), std::string::npos);
  EXPECT_THROW(make_export("<html></html>", {}), std::runtime_error);
  EXPECT_THROW(make_export("<script id=\"sls-mode\">", {}), std::runtime_error);
}

class ExportFileTest : public ::testing::Test {
 protected:
  ExportFileTest() {
    for (const char* name : {"a", "b"}) {
      fs::create_directory(folder_ / name);
      record::test::record_flight(folder_ / name);
    }
  }
  sls::test::TemporaryFolder folder_;
  const fs::path file_ = folder_ / "page.html";
};

TEST_F(ExportFileTest, OneFileHoldsBothRecordingsWithinItsBudget) {
  for (const std::size_t most : {30'000u, 50'000u, 200'000u}) {
    export_page(file_, zip(kPage), {folder_ / "a", folder_ / "b"}, most);
    const std::string html = read_bytes(file_);
    EXPECT_LE(html.size(), most);
    EXPECT_EQ(test::unpack(read_block(html, 0)).head.at("name"), "a");
    EXPECT_EQ(test::unpack(read_block(html, 1)).head.at("name"), "b");
  }
  export_page(file_, zip(kPage), {folder_ / "a"}, 1 << 20);
  EXPECT_EQ(read_block(read_bytes(file_), 0), load_recorded_run(folder_ / "a", 1 << 20));
}

TEST_F(ExportFileTest, TheSameRecordingGivesTheSameBytes) {
  export_page(file_, zip(kPage), {folder_ / "a"}, 30'000);
  const std::string first = read_bytes(file_);
  export_page(file_, zip(kPage), {folder_ / "a"}, 30'000);
  EXPECT_EQ(read_bytes(file_), first);
}

TEST_F(ExportFileTest, AFailureLeavesTheEarlierFileAndNothingElse) {
  write_bytes(file_, "earlier");
  EXPECT_THROW(export_page(file_, zip(kPage), {folder_ / "none"}, 1 << 20), config::ConfigError);
  EXPECT_THROW(export_page(file_, zip(kPage), {folder_ / "a"}, 100), config::ConfigError);
  EXPECT_THROW(export_page(file_, "no gzip", {folder_ / "a"}, 1 << 20), std::runtime_error);
  EXPECT_EQ(read_bytes(file_), "earlier");
  EXPECT_THROW(export_page(folder_ / "none" / "page.html", zip(kPage), {folder_ / "a"}, 1 << 20),
               std::system_error);
  fs::create_directory(folder_ / "folder");
  EXPECT_THROW(export_page(folder_ / "folder", zip(kPage), {folder_ / "a"}, 1 << 20),
               std::system_error);
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_.path())) ++count;
  EXPECT_EQ(count, 4u);  // a, b, page.html, folder
}

}  // namespace
}  // namespace sls::view
