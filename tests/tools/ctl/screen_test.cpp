#include "tools/ctl/screen.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace sls::ctl {
namespace {

ScreenSize make_size(std::size_t columns, std::size_t rows) {
  ScreenSize size;
  size.columns = columns;
  size.rows = rows;
  return size;
}

/// Output of `draw` since the last call.
std::string take(std::ostringstream& out) {
  const std::string text = out.str();
  out.str("");
  return text;
}

TEST(ScreenTest, EachDrawingReplacesTheOneBefore) {
  std::ostringstream out;
  {
    Screen screen(out);
    screen.draw({"one", "two"}, make_size(80, 24));
    EXPECT_EQ(take(out), "\x1b[?25l\rone\x1b[K\n\rtwo\x1b[K\n\x1b[J");
    screen.draw({"three"}, make_size(80, 24));
    EXPECT_EQ(take(out), "\x1b[2A\rthree\x1b[K\n\x1b[J") << "what was below is cleared";
    screen.draw({"four", "five"}, make_size(80, 24));
    EXPECT_EQ(take(out), "\x1b[1A\rfour\x1b[K\n\rfive\x1b[K\n\x1b[J");
  }
  EXPECT_EQ(take(out), "\x1b[?25h") << "the last drawing stays, the cursor is back";
}

TEST(ScreenTest, NoMoreIsDrawnThanThereAreRows) {
  std::ostringstream out;
  Screen screen(out);
  screen.draw({"one", "two", "three"}, make_size(80, 3));
  EXPECT_EQ(take(out), "\x1b[?25l\rone\x1b[K\n\rtwo\x1b[K\n\x1b[J");
  screen.draw({"one", "two", "three"}, make_size(80, 3));
  EXPECT_EQ(take(out).substr(0, 4), "\x1b[2A");
  screen.draw({"one", "two"}, make_size(80, 0));  // a terminal that reports no height
  EXPECT_EQ(take(out), "\x1b[H\x1b[J\rone\x1b[K\n\x1b[J");
}

TEST(ScreenTest, AResizedTerminalIsDrawnAfresh) {
  std::ostringstream out;
  Screen screen(out);
  screen.draw({"one"}, make_size(80, 24));
  take(out);
  screen.draw({"one"}, make_size(40, 24));
  EXPECT_EQ(take(out), "\x1b[H\x1b[J\rone\x1b[K\n\x1b[J");
  screen.draw({"one"}, make_size(40, 24));
  EXPECT_EQ(take(out), "\x1b[1A\rone\x1b[K\n\x1b[J");
}

}  // namespace
}  // namespace sls::ctl
