#include "python/bindings/row_buffer.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

namespace sls::python {
namespace {

constexpr std::size_t kKeptBytes = 64 << 20;
constexpr std::size_t kHugePage = 2 << 20;

struct Block {
  void* memory = nullptr;
  std::size_t bytes = 0;
};

/// Unused blocks of memory. Their pages are not returned to the system.
class Pool {
 public:
  Block take(std::size_t bytes) {
    {
      const std::lock_guard lock(mutex_);
      for (auto block = blocks_.begin(); block != blocks_.end(); ++block) {
        if (block->bytes < bytes || block->bytes > 4 * bytes) continue;
        const Block found = *block;
        kept_ -= found.bytes;
        blocks_.erase(block);
        return found;
      }
    }
    if (bytes < kHugePage) return check({std::malloc(bytes), bytes});
    bytes = (bytes + kHugePage - 1) / kHugePage * kHugePage;
    const Block block = check({std::aligned_alloc(kHugePage, bytes), bytes});
    ::madvise(block.memory, bytes, MADV_HUGEPAGE);  // uses larger pages if the system has them
    return block;
  }

  void give_back(const Block& block) {
    const std::lock_guard lock(mutex_);
    if (kept_ + block.bytes > kKeptBytes) return std::free(block.memory);
    kept_ += block.bytes;
    blocks_.push_back(block);
  }

 private:
  static Block check(const Block& block) {
    if (!block.memory) throw std::bad_alloc();
    return block;
  }

  std::mutex mutex_;
  std::vector<Block> blocks_;
  std::size_t kept_ = 0;
};

/// The pool is never destroyed, because Python arrays may live longer than this library's objects.
Pool& pool() {
  static Pool* const held = new Pool;
  return *held;
}

}  // namespace

RowBuffer::RowBuffer(std::size_t width, std::size_t rows) : width_(width) {
  const Block block = pool().take(std::max<std::size_t>(rows, 16) * width * sizeof(double));
  cells_ = static_cast<double*>(block.memory);
  capacity_ = block.bytes / sizeof(double);
}

RowBuffer::RowBuffer(RowBuffer&& other) noexcept
    : width_(other.width_),
      used_(other.used_),
      capacity_(other.capacity_),
      cells_(std::exchange(other.cells_, nullptr)) {}

RowBuffer::~RowBuffer() {
  if (cells_) pool().give_back({cells_, capacity_ * sizeof(double)});
}

void RowBuffer::grow() {
  const Block block = pool().take(2 * capacity_ * sizeof(double));
  std::memcpy(block.memory, cells_, used_ * sizeof(double));
  pool().give_back({cells_, capacity_ * sizeof(double)});
  cells_ = static_cast<double*>(block.memory);
  capacity_ = block.bytes / sizeof(double);
}

}  // namespace sls::python
