#include "recorder/sinks/csv/csv_reader.hpp"

#include <gtest/gtest.h>

#include "recorder/sinks/csv/csv_file.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::record {
namespace {

using sls::test::write_bytes;
using Rows = std::vector<std::vector<std::string>>;

class CsvReaderTest : public testing::Test {
 protected:
  Rows read(const std::string& bytes, const std::string& header = "a,b") {
    write_bytes(path_, bytes);
    CsvReader reader(path_, header);
    Rows rows;
    while (reader.next()) rows.emplace_back(reader.fields().begin(), reader.fields().end());
    EXPECT_FALSE(reader.next());
    return rows;
  }
  std::string find_error(const std::string& bytes) {
    return sls::test::find_error<DamagedError>([&] { read(bytes); });
  }

  const sls::test::TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "file.csv";
};

TEST_F(CsvReaderTest, FieldsComeBackAsTheyWereWritten) {
  Rows rows;
  for (int i = 0; i < 20000; ++i)  // several blocks
    rows.push_back({std::to_string(i), i % 3 == 0 ? "a,\"b\"\nc\r\n" : std::string(i % 40, 'x')});
  {
    CsvFile file(path_, "a,b");
    for (const auto& row : rows) {
      for (const auto& field : row) file.add(field);
      file.end_row();
    }
    file.flush();
  }
  EXPECT_EQ(read(sls::test::read_bytes(path_)), rows);
}

TEST_F(CsvReaderTest, ACutLastRowIsNoRow) {
  const std::string whole = "a,b\n1,2\n";
  const std::string cut = "3,\"x\ny\"\n";
  for (std::size_t length = 0; length < cut.size(); ++length)
    EXPECT_EQ(read(whole + cut.substr(0, length)), (Rows{{"1", "2"}})) << length;
  EXPECT_EQ(read(whole + cut), (Rows{{"1", "2"}, {"3", "x\ny"}}));
}

TEST_F(CsvReaderTest, ErrorsNameFileAndLine) {
  const std::string file = path_.string();
  EXPECT_EQ(find_error("a,c\n"), file + ":1: expected the columns a,b");
  EXPECT_EQ(find_error(""), file + ":1: expected the columns a,b");
  EXPECT_EQ(find_error("a,b\n1,2\n1\n"), file + ":3: expected 2 fields, got 1");
  EXPECT_EQ(find_error("a,b\n1,2\n\n"), file + ":3: expected 2 fields, got 1");
  EXPECT_EQ(find_error("a,b\n\"x\ny\",2\n1,2,3\n"), file + ":4: expected 2 fields, got 3");
  EXPECT_EQ(find_error("a,b\n\"x\"y,2\n"), file + ":2: expected a comma after a quoted field");
  EXPECT_EQ(find_error("a,b\n" + std::string(2'000'000, 'x')),
            file + ":2: expected a row, got no end");
}

TEST_F(CsvReaderTest, FurtherColumnsAreReadWhereTheyAreAllowed) {
  const auto find_columns = [&](const std::string& header) {
    write_bytes(path_, header + "\n1,2,3\n");
    CsvReader reader(path_, "a,b", CsvReader::Further::kAllowed);
    EXPECT_EQ(reader.next(), reader.columns().size() == 3);
    return reader.columns();
  };
  EXPECT_EQ(find_columns("a,b,c"), (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_THROW(find_columns("a,b"), DamagedError) << "its row has three fields";
  EXPECT_THROW(find_columns("a,bc"), DamagedError);
  EXPECT_THROW(find_columns("a,c,b"), DamagedError);
  EXPECT_EQ(find_error("a,b,c\n"), path_.string() + ":1: expected the columns a,b");
}

TEST_F(CsvReaderTest, AFileThatIsNotThereIsNamed) {
  EXPECT_THROW(CsvReader(folder_ / "none.csv", "a"), DamagedError);
}

}  // namespace
}  // namespace sls::record
