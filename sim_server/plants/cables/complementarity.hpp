/// The linear complementarity problem of the cables: which of them pull, and how strongly. One
/// solver for accelerations and impacts. README.md, eqs. (5) and (6). Plain loops in a fixed order.
#pragma once

#include <array>
#include <cstddef>

namespace sls::sim::cables {

inline constexpr std::size_t kMaxCables = 16;

using Vector = std::array<double, kMaxCables>;
using Matrix = std::array<Vector, kMaxCables>;

/// The load, where vehicles are counted by their cables.
inline constexpr std::size_t kLoad = kMaxCables;

/// Some of the cables, or some of the bodies (vehicles and kLoad), ascending.
class Members {
 public:
  Members() = default;
  /// The cables 0 to `count` − 1.
  static Members all(std::size_t count);

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::size_t operator[](std::size_t place) const { return cables_[place]; }
  const std::size_t* begin() const { return cables_.data(); }
  const std::size_t* end() const { return cables_.data() + size_; }
  bool has(std::size_t cable) const;
  void add(std::size_t cable);  ///< stays ascending; a second time has no effect
  void remove(std::size_t cable);
  bool operator==(const Members& other) const;

 private:
  std::array<std::size_t, kMaxCables + 1> cables_;
  std::size_t size_ = 0;
};

/// L D Lᵀ of the rows and columns `members` of a symmetric positive definite matrix, whose lower
/// triangle is read. Of linearly dependent rows the later ones get x = 0.
class Factor {
 public:
  void compute(const Matrix& a, const Members& members);
  /// Solves A x = `b` for the members; other elements of x are kept.
  void solve(const Vector& b, Vector& x) const;

 private:
  Members members_;
  Matrix lower_;      // L below its diagonal of ones, by place among the members
  Vector inverse_d_;  // 1 / D
};

/// The solution of A λ + b = w, λ ≥ 0, w ≥ 0, λᵀ w = 0 over `candidates`.
struct Complementarity {
  Vector pull;     ///< λ; 0 for all others
  Members active;  ///< the candidates with w = 0
};

/// Least-index principal pivoting (K. G. Murty, Opsearch 11, 1974, pp. 123–130). It ends
/// for every P-matrix, so for the positive definite `a`, both triangles of which are read.
/// @throws std::runtime_error after 2^16 pivots, which needs an `a` that is not positive definite.
Complementarity solve_complementarity(const Matrix& a, const Vector& b, const Members& candidates);

}  // namespace sls::sim::cables
