/// The terminal a live view is drawn on.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

namespace sls::ctl {

struct ScreenSize {
  std::size_t columns = 80;
  std::size_t rows = 24;
};

/// True if standard output is a terminal.
bool is_terminal();

/// Size of that terminal; the default values if it reports none.
ScreenSize find_screen_size();

/// Draws lines in place and hides the cursor. Each drawing replaces the one before in a single
/// write, without clearing first, to avoid flicker. The last drawing stays.
class Screen {
 public:
  explicit Screen(std::ostream& out);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// `lines` are not longer than `size.columns`; those beyond `size.rows` are left out.
  void draw(const std::vector<std::string>& lines, const ScreenSize& size);

 private:
  std::ostream& out_;
  ScreenSize size_{0, 0};       // at the last drawing
  std::size_t rows_drawn_ = 0;  // at the last drawing
};

}  // namespace sls::ctl
