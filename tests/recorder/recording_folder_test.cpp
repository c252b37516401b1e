#include "recorder/recording_folder.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <iostream>

#include "common/config/config_error.hpp"
#include "tests/recorder/flights.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::record {
namespace {

namespace fs = std::filesystem;
using sls::test::write_bytes;

constexpr const char* kFiles[] = {"state.csv",     "measured.csv",      "command.csv",
                                  "reference.csv", "status.csv",        "flight.csv",
                                  "sls.mcap",      "flight.txt",        "scenario.yaml",
                                  "manifest.json", "manifest.json.part"};

class RecordingFolderTest : public testing::Test {
 protected:
  /// The message of the ConfigError, or "no error". Expects one line that names the place.
  std::string find_error(const fs::path& folder, bool force = false) {
    const std::string text = sls::test::find_error<config::ConfigError>(
        [&] { prepare_recording_folder(folder, force); });
    if (text != "no error") EXPECT_NE(text.find("--out " + folder.string()), text.npos) << text;
    EXPECT_EQ(text.find('\n'), text.npos) << text;
    return text;
  }

  void fill(const fs::path& folder) {
    fs::create_directories(folder);
    for (const char* name : kFiles) write_bytes(folder / name, "old");
  }

  const sls::test::TemporaryFolder root_;
  const fs::path out_ = root_ / "out";
};

TEST_F(RecordingFolderTest, ANewFolderAndThoseOnTheWayAreMade) {
  for (const fs::path& folder : {out_, out_ / "a/b/c", out_ / "with/slash/"}) {
    EXPECT_EQ(find_error(folder), "no error");
    EXPECT_TRUE(fs::is_directory(folder));
    EXPECT_TRUE(fs::is_empty(folder));
    fs::remove_all(out_);
  }
}

TEST_F(RecordingFolderTest, AFolderWithoutARecordingIsRemovedAgain) {
  { const RecordingFolder folder(out_ / "a/b", false); }
  EXPECT_FALSE(fs::exists(out_));
  fs::create_directory(out_);
  {
    const RecordingFolder folder(out_, false);
    for (const char* name : {"state.csv", "notes"}) write_bytes(out_ / name, "");
  }
  EXPECT_FALSE(fs::exists(out_ / "state.csv"));
  EXPECT_TRUE(fs::exists(out_ / "notes")) << "removed what is not ours";
  {
    const RecordingFolder folder(out_ / "c/", false);
    for (const char* name : {"state.csv", "manifest.json"}) write_bytes(out_ / "c" / name, "");
  }
  EXPECT_TRUE(fs::exists(out_ / "c/state.csv"));
}

TEST_F(RecordingFolderTest, AnEmptyFolderIsAccepted) {
  fs::create_directory(out_);
  EXPECT_EQ(find_error(out_), "no error");
  fs::create_directory_symlink(out_, root_ / "link");
  EXPECT_EQ(find_error(root_ / "link"), "no error");
}

TEST_F(RecordingFolderTest, AFolderThatIsNotEmptyIsRefusedAndKept) {
  fill(out_);
  const std::string error = find_error(out_);
  EXPECT_NE(error.find("--force"), std::string::npos) << error;
  for (const char* name : kFiles) EXPECT_EQ(sls::test::read_bytes(out_ / name), "old");

  fs::create_directory(root_ / "other");
  write_bytes(root_ / "other/thesis.tex", "years of work");
  EXPECT_NE(find_error(root_ / "other").find("'thesis.tex'"), std::string::npos);
}

TEST_F(RecordingFolderTest, ForceReplacesARecording) {
  fill(out_);
  EXPECT_EQ(find_error(out_, true), "no error");
  EXPECT_TRUE(fs::is_empty(out_));
}

TEST_F(RecordingFolderTest, ForceTakesNewAndEmptyFoldersToo) {
  EXPECT_EQ(find_error(out_, true), "no error");
  EXPECT_EQ(find_error(out_, true), "no error");
}

TEST_F(RecordingFolderTest, ForceRefusesForeignFilesAndRemovesNothing) {
  for (const char* foreign : {"thesis.tex", "state.csv.bak", ".hidden", "STATE.CSV"}) {
    fs::remove_all(out_);
    fill(out_);
    write_bytes(out_ / foreign, "mine");
    const std::string error = find_error(out_, true);
    EXPECT_NE(error.find(std::string("'") + foreign + "'"), std::string::npos) << error;
    for (const char* name : kFiles) EXPECT_TRUE(fs::exists(out_ / name)) << name;
    EXPECT_TRUE(fs::exists(out_ / foreign));
  }
}

TEST_F(RecordingFolderTest, ForceRefusesAFolderThatIsCalledLikeAFileAndRemovesNothing) {
  for (const bool is_empty : {true, false}) {
    fs::remove_all(out_);
    fill(out_);
    fs::remove(out_ / "status.csv");
    fs::create_directory(out_ / "status.csv");
    if (!is_empty) write_bytes(out_ / "status.csv/inside", "x");
    const std::string error = find_error(out_, true);
    EXPECT_NE(error.find("'status.csv'"), std::string::npos) << error;
    EXPECT_TRUE(fs::exists(out_ / "state.csv"));
    EXPECT_TRUE(fs::is_directory(out_ / "status.csv"));
  }
}

TEST_F(RecordingFolderTest, ForceReplacesSegmentsFurtherRunsFiguresAndReportToo) {
  for (const char* subfolder :
       {"", "segment-2", "run-0123456789abcdef", "run-0123456789abcdef/segment-10"})
    fill(out_ / subfolder);
  for (const char* subfolder : {"", "run-0123456789abcdef"}) {
    write_bytes(out_ / subfolder / "report.html", "old");
    fs::create_directory(out_ / subfolder / "figures");
    for (const char* figure : {"positions.png", "positions.pdf", "fleet.png", "body_rates.pdf"})
      write_bytes(out_ / subfolder / "figures" / figure, "old");
  }
  EXPECT_EQ(find_error(out_, true), "no error");
  EXPECT_TRUE(fs::is_empty(out_));
}

TEST_F(RecordingFolderTest, ForceRefusesSubfoldersWithAnythingElseAndRemovesNothing) {
  for (const char* foreign :
       {"segment-2/notes.txt", "run-0123456789abcdef/segment-3/notes.txt", "segment-0/state.csv",
        "run-1/state.csv", "figures/state.csv", "figures/holiday.png", "figures/path.svg",
        "figures/figures/path.png", "path.png"}) {
    SCOPED_TRACE(foreign);
    fs::remove_all(out_);
    for (const char* subfolder : {"", "segment-2", "run-0123456789abcdef"}) fill(out_ / subfolder);
    fs::create_directories((out_ / foreign).parent_path());
    write_bytes(out_ / foreign, "mine");
    EXPECT_NE(find_error(out_, true).find("which --force does not remove"), std::string::npos);
    for (const char* name : kFiles) {
      EXPECT_TRUE(fs::exists(out_ / name)) << name;
      EXPECT_TRUE(fs::exists(out_ / "segment-2" / name)) << name;
    }
    EXPECT_TRUE(fs::exists(out_ / foreign));
  }
}

// --- recordings that can be resumed --------------------------------------------------------------

class ResumeTest : public RecordingFolderTest {
 protected:
  std::string find_resume_error() {
    const std::string error =
        sls::test::find_error<config::ConfigError>([&] { find_unfinished_recording(out_); });
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    return error;
  }
};

TEST_F(ResumeTest, NewAndEmptyFoldersAndOnesWithoutARowAreFresh) {
  EXPECT_FALSE(find_unfinished_recording(out_));
  EXPECT_FALSE(find_unfinished_recording(out_));
  for (const std::string& header : {std::string(), make_header<StateRow>() + "\n",
                                    make_state_header(test::make_signal_parameters()) + "\n"}) {
    write_bytes(out_ / "state.csv", header);
    write_bytes(out_ / "command.csv", "");
    EXPECT_FALSE(find_unfinished_recording(out_));
    EXPECT_TRUE(fs::is_empty(out_));
  }
}

TEST_F(ResumeTest, AnUnfinishedRecordingIsFound) {
  fs::create_directory(out_);
  test::record_until_killed(test::make_segment(out_), 0, 100);
  const auto flight = find_unfinished_recording(out_);
  ASSERT_TRUE(flight);
  EXPECT_EQ(flight->manifest().run_id, "0123456789abcdef");
  EXPECT_EQ(find_next_step(*flight), 101u);
}

TEST_F(ResumeTest, ACompleteRecordingIsRefused) {
  fs::create_directory(out_);
  test::record_flight(out_);
  EXPECT_NE(find_resume_error().find("got a complete one"), std::string::npos);
}

TEST_F(ResumeTest, AFolderThatIsNoRecordingIsRefusedAndKept) {
  fill(out_);
  EXPECT_NE(find_resume_error().find("manifest.json"), std::string::npos);
  fs::remove(out_ / "manifest.json");
  write_bytes(out_ / "state.csv", std::string(1000, 'x') + "\nx");
  EXPECT_NE(find_resume_error().find("expected an empty folder"), std::string::npos);
  EXPECT_TRUE(fs::exists(out_ / "state.csv"));
  write_bytes(out_ / "state.csv", "");
  fs::resize_file(out_ / "state.csv", std::uintmax_t{1} << 40);  // one line of 1 TiB
  EXPECT_NE(find_resume_error().find("expected an empty folder"), std::string::npos);
  fs::remove(out_ / "state.csv");
  ASSERT_EQ(::mkfifo((out_ / "state.csv").c_str(), 0600), 0);
  EXPECT_NE(find_resume_error().find("expected an empty folder"), std::string::npos);
}

TEST_F(RecordingFolderTest, ALinkIsRemovedAndItsTargetKept) {
  fs::create_directory(out_);
  write_bytes(root_ / "target", "kept");
  fs::create_symlink(root_ / "target", out_ / "state.csv");
  EXPECT_EQ(find_error(out_, true), "no error");
  EXPECT_TRUE(fs::is_empty(out_));
  EXPECT_EQ(sls::test::read_bytes(root_ / "target"), "kept");
}

TEST_F(RecordingFolderTest, AFileInsteadOfAFolderIsRefused) {
  write_bytes(out_, "a file");
  for (const bool force : {false, true}) {
    const std::string error = find_error(out_, force);
    EXPECT_NE(error.find("a file"), std::string::npos) << error;
  }
  EXPECT_EQ(sls::test::read_bytes(out_), "a file");
}

// Root ignores permission bits: in these places root cannot create a folder either.
TEST_F(RecordingFolderTest, APlaceWhereNoFolderCanBeIsRefused) {
  write_bytes(out_, "a file");
  EXPECT_NE(find_error(out_ / "below"), "no error");
  EXPECT_NE(find_error("/proc/sls-recording"), "no error");
  EXPECT_NE(find_error(""), "no error");
  EXPECT_NE(find_error(root_ / std::string(300, 'x')), "no error");
  EXPECT_NE(find_error(root_ / std::string(300, 'x'), true), "no error");
  fs::create_directory_symlink(root_ / "loop", root_ / "loop");
  EXPECT_NE(find_error(root_ / "loop"), "no error");
}

TEST_F(RecordingFolderTest, AFolderThatCannotBeWrittenIsRefused) {
  fs::create_directory(out_);
  fs::permissions(out_, fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_read |
                            fs::perms::others_exec);
  fs::permissions(root_.path(), fs::perms(0755));
  EXPECT_EXIT(
      {
        if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(1);  // user nobody
        std::cerr << find_error(out_) << std::endl << find_error(out_ / "below") << std::endl;
        ::_exit(2);
      },
      testing::ExitedWithCode(2), "can be written.*Permission denied\n.*below.*Permission denied");
}

}  // namespace
}  // namespace sls::record
