/// A table of numbers in one block of memory, to which rows are added one by one.
#pragma once

#include <cstddef>

namespace sls::python {

/// A cell has 8 bytes: a double or an integer. The memory of destroyed buffers is kept, up to a
/// bound, for the next buffers, because new pages from the system take as long as half a flight.
class RowBuffer {
 public:
  /// `rows`: expected number of rows.
  RowBuffer(std::size_t width, std::size_t rows);
  ~RowBuffer();
  RowBuffer(RowBuffer&& other) noexcept;
  RowBuffer& operator=(RowBuffer&&) = delete;
  RowBuffer(const RowBuffer&) = delete;
  RowBuffer& operator=(const RowBuffer&) = delete;

  /// Adds a row with undefined cells and returns it. The pointer is valid until the next call.
  /// @throws std::bad_alloc
  double* add_row() {
    if (used_ + width_ > capacity_) grow();
    double* const row = cells_ + used_;
    used_ += width_;
    return row;
  }

  std::size_t width() const { return width_; }
  std::size_t rows() const { return used_ / width_; }
  const double* row(std::size_t index) const { return cells_ + index * width_; }

 private:
  void grow();

  std::size_t width_;
  std::size_t used_ = 0;  // cells
  std::size_t capacity_;  // cells
  double* cells_;
};

}  // namespace sls::python
