// Compares the table of columns with the reference page and with the headers of the files.
#include "recorder/columns.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include "common/config/config_error.hpp"
#include "recorder/rows.hpp"
#include "sim_server/plants/plant.hpp"
#include "tests/recorder/synthetic_run.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::record {
namespace {

TEST(ColumnsTest, TheReferencePageHasTheRowsOfTheProgram) {
  const std::string page = sls::test::read_bytes(SLS_SOURCE_DIR "/docs/reference/recordings.md");
  std::istringstream rows(describe_columns());
  for (std::string row; std::getline(rows, row);) {
    if (row.rfind('|', 0) == 0) {
      EXPECT_NE(page.find(row + '\n'), page.npos)
          << "docs/reference/recordings.md is stale; expected " << row;
    }
  }
}

TEST(ColumnsTest, VectorsHaveAColumnForEachComponent) {
  const std::string text = describe_columns();
  EXPECT_NE(text.find("| `quad_x_m`, `quad_y_m`, `quad_z_m` | m | "), text.npos);
  EXPECT_NE(text.find("| `att_w`, `att_x`, `att_y`, `att_z` |"), text.npos);
  EXPECT_EQ(make_header<CommandRow>(),
            "vehicle_id,step,controller,force_x_n,force_y_n,force_z_n,compute_us,fault");
}

TEST(ColumnsTest, AttitudeRatesAndSignalsFollowTheOthers) {
  const std::string plain = make_header<StateRow>();
  EXPECT_EQ(make_state_header(test::make_parameters()), plain);
  EXPECT_EQ(make_state_header(test::make_signal_parameters()),
            plain +
                ",att_w,att_x,att_y,att_z,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,"
                "tension_n,wind");
}

TEST(ColumnsTest, ThePlantsReserveTheNamesOfTheColumnsBeforeTheSignals) {
  StepRows rows;
  rows.has_attitude = true;
  std::vector<std::string> names;
  for (const auto& column : list_columns<StateRow>(rows))
    names.insert(names.end(), column.names.begin(), column.names.end());
  EXPECT_EQ(sim::list_reserved_signal_names(), names);
}

TEST(ColumnsTest, SignalsThatCannotBeColumnsAreRefused) {
  for (const char* name :
       {"", "a,b", "two words", "line\nbreak", "\"", "step", "att_w", "tension_n"}) {
    Parameters parameters = test::make_signal_parameters();
    parameters.signals()[1].name(name);
    EXPECT_THROW(make_state_header(parameters), config::ConfigError) << name;
  }
}

}  // namespace
}  // namespace sls::record
