#include "recorder/sinks/csv/csv_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <system_error>
#include <vector>

#include "tests/recorder/csv_table.hpp"
#include "tests/recorder/file_size_limit.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using sls::test::read_bytes;
using test::parse_csv;

double to_double(std::uint64_t bits) {
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}
std::uint64_t to_bits(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// The descriptor on which this process has `file` open; −1 if there is none.
int find_descriptor(const fs::path& file) {
  for (int descriptor = 3; descriptor < 1024; ++descriptor) {
    std::error_code error;
    if (fs::read_symlink("/proc/self/fd/" + std::to_string(descriptor), error) == file && !error)
      return descriptor;
  }
  return -1;
}

class CsvFileTest : public testing::Test {
 protected:
  const sls::test::TemporaryFolder folder_;
  const fs::path path_ = fs::canonical(folder_.path()) / "file.csv";
};

TEST_F(CsvFileTest, TheHeaderIsTheFirstLine) {
  CsvFile file(path_, "a,b");
  file.flush();
  EXPECT_EQ(read_bytes(path_), "a,b\n");
  EXPECT_EQ(file.rows(), 0u);
  EXPECT_EQ(file.path(), path_);
}

TEST_F(CsvFileTest, FieldsOfAllKindsMakeARow) {
  CsvFile file(path_, "h");
  file.add(std::uint64_t{18446744073709551615u});
  file.add(std::int64_t{std::numeric_limits<std::int64_t>::min()});
  file.add("text");
  file.add(0.5);
  file.add_all(std::array<double, 3>{1, -2, 1e300});
  file.add("");
  file.end_row();
  file.flush();
  EXPECT_EQ(read_bytes(path_),
            "h\n18446744073709551615,-9223372036854775808,text,0.5,1,-2,1e+300,\n");
  EXPECT_EQ(file.rows(), 1u);
}

TEST_F(CsvFileTest, FieldsAndRowsMayBeOfAnyLength) {
  CsvFile file(path_, "h");
  std::string expected = "h\n";
  for (const std::size_t length : {0, 1, 30, 31, 32, 33, 1000, 100'000}) {
    const std::string text(length, '"');  // each is doubled inside quotes
    const std::string quoted = length == 0 ? "" : '"' + text + text + '"';
    file.add(text);
    file.add(-2.2250738585072014e-308);
    file.add(text);
    file.end_row();
    expected += quoted + ",-2.2250738585072014e-308," + quoted + '\n';
    file.end_row();  // a row without fields
    expected += '\n';
  }
  file.flush();
  EXPECT_TRUE(read_bytes(path_) == expected);
  EXPECT_EQ(file.rows(), 16u);
}

TEST_F(CsvFileTest, RowsAreCounted) {
  CsvFile file(path_, "h");
  for (int i = 0; i < 12345; ++i) {
    file.add(i);
    file.end_row();
  }
  EXPECT_EQ(file.rows(), 12345u);
  file.flush();
  EXPECT_EQ(parse_csv(read_bytes(path_)).rows.size(), 12345u);
}

TEST_F(CsvFileTest, NumbersReadBackToTheSameDouble) {
  using Limits = std::numeric_limits<double>;
  std::vector<double> values = {0.0,
                                -0.0,
                                Limits::denorm_min(),
                                -Limits::denorm_min(),
                                Limits::min(),
                                Limits::max(),
                                Limits::lowest(),
                                Limits::epsilon(),
                                0.1,
                                1.0 / 3.0,
                                1e22,
                                1e23,
                                9007199254740993.0,
                                5e-324,
                                2.2250738585072011e-308};
  std::mt19937_64 random(1);
  while (values.size() < 50000) {
    const double value = to_double(random());  // any exponent, denormals included
    if (std::isfinite(value)) values.push_back(value);
    values.push_back(to_double(random() & 0x800fffffffffffff));  // denormals
    values.push_back(static_cast<double>(random() % 100000) / 1000.0);
  }
  CsvFile file(path_, "value");
  for (const double value : values) {
    file.add(value);
    file.end_row();
  }
  file.flush();
  const auto table = parse_csv(read_bytes(path_));
  ASSERT_EQ(table.rows.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string& text = table.rows[i].at(0);
    double parsed = 0;
    const auto end = std::from_chars(text.data(), text.data() + text.size(), parsed).ptr;
    ASSERT_EQ(end, text.data() + text.size()) << text;
    ASSERT_EQ(to_bits(parsed), to_bits(values[i])) << text;
    ASSERT_EQ(to_bits(std::strtod(text.c_str(), nullptr)), to_bits(values[i])) << text;
  }
}

TEST_F(CsvFileTest, ANumberThatComesAgainHasTheSameText) {
  std::mt19937_64 random(2);
  std::vector<double> values(600);  // more than there are texts that are kept
  for (double& value : values) value = to_double(random() & 0xbfffffffffffffff);
  values.push_back(0.0);
  values.push_back(-0.0);
  CsvFile file(path_, "value,again");
  std::string expected = "value,again\n";
  for (int i = 0; i < 20000; ++i) {
    const double value = values[random() % values.size()];
    std::array<char, 32> text;
    const std::string plain(text.data(), std::to_chars(text.begin(), text.end(), value).ptr);
    file.add(value);
    file.add(value);
    file.end_row();
    expected += plain + ',' + plain + '\n';
  }
  file.flush();
  EXPECT_EQ(read_bytes(path_), expected);
}

TEST_F(CsvFileTest, NonFiniteNumbersAreWrittenAsWords) {
  CsvFile file(path_, "h");
  file.add(std::numeric_limits<double>::infinity());
  file.add(-std::numeric_limits<double>::infinity());
  file.add(std::numeric_limits<double>::quiet_NaN());
  file.end_row();
  file.flush();
  EXPECT_EQ(read_bytes(path_), "h\ninf,-inf,nan\n");
}

TEST_F(CsvFileTest, AnyTextSurvivesWritingAndReading) {
  const std::vector<std::string> texts = {"plain", "a,b", "say \"hi\"", "two\nlines", "cr\rlf\r\n",
                                          "\"",    ",",   " spaces ",   "ä€",         "\",\"\n\""};
  CsvFile file(path_, "h");
  for (const auto& text : texts) file.add(text);
  file.end_row();
  file.add("next");
  file.end_row();
  file.flush();
  const auto table = parse_csv(read_bytes(path_));
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0], texts);
  EXPECT_EQ(table.rows[1], std::vector<std::string>{"next"});
}

TEST_F(CsvFileTest, PlainTextsAreNotQuoted) {
  CsvFile file(path_, "h");
  file.add("figure_eight 1");
  file.end_row();
  file.flush();
  EXPECT_EQ(read_bytes(path_), "h\nfigure_eight 1\n");
}

TEST_F(CsvFileTest, NeverCreatesOverAnExistingFile) {
  sls::test::write_bytes(path_, "precious");
  const std::string error = sls::test::find_error<std::system_error>([&] { CsvFile(path_, "h"); });
  EXPECT_NE(error.find(path_.string()), std::string::npos) << error;
  EXPECT_NE(error.find("File exists"), std::string::npos) << error;
  EXPECT_EQ(read_bytes(path_), "precious");
  fs::create_symlink("/nowhere/else", folder_ / "link.csv");
  EXPECT_THROW(CsvFile(folder_ / "link.csv", "h"), std::system_error);
}

TEST_F(CsvFileTest, AFolderThatIsNotThereIsNamed) {
  const std::string error =
      sls::test::find_error<std::system_error>([&] { CsvFile(folder_ / "no" / "file.csv", "h"); });
  EXPECT_NE(error.find("no/file.csv"), std::string::npos) << error;
  EXPECT_NE(error.find("No such file or directory"), std::string::npos) << error;
}

TEST_F(CsvFileTest, OnlyWholeRowsReachTheFile) {
  CsvFile file(path_, "a,b");
  file.add(1);
  file.add(2);
  file.end_row();
  file.add(3);
  file.flush();
  EXPECT_EQ(read_bytes(path_), "a,b\n1,2\n");
  file.add(4);
  file.end_row();
  file.flush();
  EXPECT_EQ(read_bytes(path_), "a,b\n1,2\n3,4\n");
  EXPECT_EQ(file.rows(), 2u);
}

TEST_F(CsvFileTest, WithoutFlushMemoryStaysBounded) {
  CsvFile file(path_, "h");
  for (int i = 0; i < 200000; ++i) {
    file.add(1.0 / (1.0 + i));
    file.end_row();
  }
  const auto written = fs::file_size(path_);
  EXPECT_GT(written, 3'000'000u);  // of about 4.2 MB; the rest is pending
  const std::string bytes = read_bytes(path_);
  EXPECT_EQ(bytes.back(), '\n');
}

TEST_F(CsvFileTest, DestroyedWithoutFlushTheFileStillParses) {
  {
    CsvFile file(path_, "a,b");
    file.add(1);
    file.add("x,\ny");
    file.end_row();
    file.flush();
    file.add(2);
    file.add("lost");
    file.end_row();
    file.add(3);
  }
  const auto table = parse_csv(read_bytes(path_));
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"1", "x,\ny"}));
}

TEST_F(CsvFileTest, AFullDiskIsReportedWithTheFilesName) {
  CsvFile file(path_, "h");
  const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(full, 0);
  ASSERT_GE(::dup2(full, find_descriptor(path_)), 0);  // from here its disk is full
  ::close(full);
  file.add(1);
  file.end_row();
  const std::string text = sls::test::find_error<std::system_error>([&] { file.flush(); });
  EXPECT_NE(text.find(path_.string()), std::string::npos) << text;
  EXPECT_NE(text.find("No space left on device"), std::string::npos) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

TEST_F(CsvFileTest, AShortOrInterruptedWriteIsContinued) {
  int calls = 0;
  CsvFile file(path_, "a,b", [&](int descriptor, const void* bytes, std::size_t) -> ssize_t {
    if (++calls % 2 == 1) return ::write(descriptor, bytes, 1);
    errno = EINTR;
    return -1;
  });
  file.add(1);
  file.add("x");
  file.end_row();
  file.flush();
  EXPECT_EQ(read_bytes(path_), "a,b\n1,x\n");
  EXPECT_EQ(calls, 15);  // a byte, an interruption, a byte, …
}

/// Writes `rows` rows into a file that may have at most `limit` bytes. @returns true on an error.
/// Row i has i, a text with commas, quotes and line breaks, and i again.
bool write_limited(CsvFile& file, rlim_t limit, int rows) {
  const test::FileSizeLimit in_force(limit);
  try {
    for (int i = 0; i < rows; ++i) {
      file.add(i);
      file.add("a,\"b\"\nc\n\"d");
      file.add(i);
      file.end_row();
    }
    file.flush();
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), EFBIG) << error.what();
    return true;
  }
  return false;
}

TEST_F(CsvFileTest, ARowTheDiskTookInPartIsCutBack) {
  for (rlim_t limit = 0; limit < 120; ++limit) {
    SCOPED_TRACE("limit " + std::to_string(limit));
    fs::remove(path_);
    CsvFile file(path_, "number,text,again");
    ASSERT_TRUE(write_limited(file, limit, 20));
    const std::string bytes = read_bytes(path_);
    EXPECT_LE(bytes.size(), limit);
    const auto table = parse_csv(bytes);
    ASSERT_TRUE(table.is_whole) << bytes;
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      ASSERT_EQ(table.rows[i].size(), 3u) << bytes;
      EXPECT_EQ(table.rows[i][0], std::to_string(i));
      EXPECT_EQ(table.rows[i][2], std::to_string(i));
    }
    EXPECT_EQ(table.header.size(), limit < 18 ? 0u : 3u);
    // The file has all rows that fit: one more would exceed the limit.
    EXPECT_GT(bytes.size() + 21, limit);
  }
}

TEST_F(CsvFileTest, BytesOnTheDiskAreNotWrittenAgain) {
  CsvFile file(path_, "number,text,again");
  ASSERT_TRUE(write_limited(file, 60, 20));
  file.flush();  // the disk has room again
  const auto table = parse_csv(read_bytes(path_));
  ASSERT_EQ(table.rows.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(table.rows[i][0], std::to_string(i));
}

}  // namespace
}  // namespace sls::record
