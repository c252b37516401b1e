#include "tools/view/replay/export.hpp"

#include <openssl/evp.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "common/config/config_error.hpp"
#include "tools/view/replay/recorded_run.hpp"

namespace sls::view {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPageBytes = 16 << 20;
constexpr std::string_view kModeId = "id=\"sls-mode\"";

std::string to_base64(std::string_view bytes) {
  std::string text((bytes.size() + 2) / 3 * 4, '\0');  // a NUL is written behind it
  ::EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                    reinterpret_cast<const unsigned char*>(bytes.data()),
                    static_cast<int>(bytes.size()));
  return text;
}

/// `count` JSON strings of `before` and a number, such as "/recording/0","/recording/1".
std::string list_sources(std::string_view before, std::size_t count) {
  std::string list;
  for (std::size_t index = 0; index < count; ++index)
    list += fmt::format("{}\"{}{}\"", index ? "," : "", before, index);
  return list;
}

void write_file(const fs::path& file, const std::string& bytes) {
  fs::path part = file;
  part += fmt::format(".{}.part", ::getpid());
  try {
    errno = 0;
    std::ofstream stream(part, std::ios::binary | std::ios::trunc);
    stream << bytes;
    stream.close();
    if (!stream)
      throw std::system_error(errno, std::generic_category(), file.string() + ": cannot write");
    fs::rename(part, file);
  } catch (const std::system_error&) {
    std::error_code ignored;
    fs::remove(part, ignored);
    throw;
  }
}

}  // namespace

std::string unzip(std::string_view gzip) {
  z_stream stream{};
  constexpr int kGzip = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzip) != Z_OK) throw std::runtime_error("page: zlib does not start");
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  std::string text(kMostPageBytes, '\0');
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(text.size());
  const int result = inflate(&stream, Z_FINISH);
  text.resize(stream.total_out);
  inflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::runtime_error("page: expected gzip, got other bytes");
  return text;
}

std::string set_mode(std::string_view page_html, std::string_view mode_json) {
  const auto name = page_html.find(kModeId);
  const auto begin = name == page_html.npos ? name : page_html.find('>', name);
  const auto end = begin == page_html.npos ? begin : page_html.find("</script>", begin);
  if (end == page_html.npos)
    throw std::runtime_error("page: expected a script with the id sls-mode, got none");
  std::string html(page_html.substr(0, begin + 1));
  html += mode_json;
  html += page_html.substr(end);
  return html;
}

std::string make_replay_page(std::string_view page_html_gz, std::size_t recordings) {
  return set_mode(unzip(page_html_gz), fmt::format("{{\"mode\":\"replay\",\"recordings\":[{}]}}",
                                                   list_sources("/recording/", recordings)));
}

std::string make_export(std::string_view page_html, const std::vector<std::string>& recordings) {
  std::string blocks;
  for (std::size_t index = 0; index < recordings.size(); ++index) {
    blocks += fmt::format(
        "<script type=\"application/octet-stream;base64\" id=\"sls-recording-{}\">", index);
    blocks += to_base64(recordings[index]);
    blocks += "</script>\n";
  }
  std::string html =
      set_mode(page_html, fmt::format("{{\"mode\":\"embedded\",\"recordings\":[{}]}}",
                                      list_sources("#sls-recording-", recordings.size())));
  // Before the script that reads them, because a script runs as soon as it is parsed.
  return html.insert(html.rfind('<', html.find(kModeId)), blocks);
}

void export_page(const fs::path& file, std::string_view page_html_gz,
                 const std::vector<fs::path>& folders, std::size_t most_bytes) {
  const std::string page = unzip(page_html_gz);
  // The text around the data, and 4 bytes for an incomplete last group in each recording's base64.
  const std::size_t around =
      make_export(page, std::vector<std::string>(folders.size())).size() + 4 * folders.size();
  if (around > most_bytes || folders.empty())
    throw config::ConfigError(
        fmt::format("{}: expected at least {} bytes for the page alone, got at most {}",
                    file.string(), around, most_bytes));
  const std::size_t most_data = (most_bytes - around) / 4 * 3 / folders.size();
  std::vector<std::string> recordings;
  for (const fs::path& folder : folders) recordings.push_back(load_recorded_run(folder, most_data));
  write_file(file, make_export(page, recordings));
}

}  // namespace sls::view
