/// Any file after a correct header has rows with the right number of fields, or causes a
/// DamagedError.
#include <cstdint>
#include <cstdlib>

#include "recorder/sinks/csv/csv_reader.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sls;
  const fuzz::MemoryFile file(data, size);
  try {
    record::CsvReader reader(file.path(), "step,name,value");
    while (reader.next())
      if (reader.fields().size() != 3) std::abort();
  } catch (const record::DamagedError&) {
  }
  return 0;
}
