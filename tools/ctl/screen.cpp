#include "tools/ctl/screen.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

namespace sls::ctl {
namespace {

// ECMA-48 and DEC's cursor switch, which all current terminals support.
constexpr const char* kHideCursor = "\x1b[?25l";
constexpr const char* kShowCursor = "\x1b[?25h";
constexpr const char* kClearLine = "\x1b[K";   // from the cursor to the end of its line
constexpr const char* kClearBelow = "\x1b[J";  // from the cursor to the end of the screen
constexpr const char* kClearAll = "\x1b[H\x1b[J";

}  // namespace

bool is_terminal() { return isatty(STDOUT_FILENO) == 1; }

ScreenSize find_screen_size() {
  ScreenSize size;
  winsize found{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &found) == 0 && found.ws_col > 0 && found.ws_row > 0) {
    size.columns = found.ws_col;
    size.rows = found.ws_row;
  }
  return size;
}

Screen::Screen(std::ostream& out) : out_(out) { out_ << kHideCursor; }

Screen::~Screen() { out_ << kShowCursor << std::flush; }

void Screen::draw(const std::vector<std::string>& lines, const ScreenSize& size) {
  std::string text;
  const bool is_resized = size.columns != size_.columns || size.rows != size_.rows;
  if (rows_drawn_ > 0 && is_resized)  // the terminal has wrapped and moved the old lines
    text += kClearAll;
  else if (rows_drawn_ > 0)
    text += "\x1b[" + std::to_string(rows_drawn_) + "A";
  // The cursor takes one row, below the last line.
  rows_drawn_ = std::min(lines.size(), std::max<std::size_t>(size.rows, 2) - 1);
  size_ = size;
  for (std::size_t i = 0; i < rows_drawn_; ++i) text += "\r" + lines[i] + kClearLine + "\n";
  out_ << text + kClearBelow << std::flush;
}

}  // namespace sls::ctl
