/// A folder with any manifest and any rows is a recording that equals itself, or causes an error
/// that names the defect. An input consists of the files of the folder, each ended by the byte
/// 0x1e.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "common/config/config_error.hpp"
#include "recorder/verification.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

constexpr char kEnd = 0x1e;

void write_files(const std::filesystem::path& folder, std::string input) {
  for (const char* name : {"manifest.json", "state.csv", "command.csv", "reference.csv"}) {
    const auto end = input.find(kEnd);
    sls::test::write_bytes(folder / name, input.substr(0, end));
    input.erase(0, end == std::string::npos ? end : end + 1);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sls::record;
  static const sls::test::TemporaryFolder folder;
  write_files(folder.path(), std::string(data, data + size));
  try {
    const OpenedRecording flight = open_recording(folder.path());
    inspect(flight);
    list_notes(flight, flight);
    find_next_step(flight);
    if (find_first_difference(flight, flight)) std::abort();
  } catch (const sls::config::ConfigError&) {
  } catch (const DamagedError&) {
  }
  return 0;
}
