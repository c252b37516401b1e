#include "sim_server/plants/cables/complementarity.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sls::sim::cables {

Members Members::all(std::size_t count) {
  Members members;
  for (std::size_t i = 0; i < count; ++i) members.add(i);
  return members;
}

bool Members::has(std::size_t cable) const { return std::find(begin(), end(), cable) != end(); }

void Members::add(std::size_t cable) {
  if (has(cable)) return;
  std::size_t place = size_++;
  for (; place > 0 && cables_[place - 1] > cable; --place) cables_[place] = cables_[place - 1];
  cables_[place] = cable;
}

void Members::remove(std::size_t cable) {
  size_ = static_cast<std::size_t>(
      std::remove(cables_.begin(), cables_.begin() + static_cast<std::ptrdiff_t>(size_), cable) -
      cables_.begin());
}

bool Members::operator==(const Members& other) const {
  return size_ == other.size_ && std::equal(begin(), end(), other.begin());
}

void Factor::compute(const Matrix& a, const Members& members) {
  constexpr double kDependent = 1e-13;  // rounding of a pivot of 0
  members_ = members;
  Vector scaled;  // row of L times D
  for (std::size_t row = 0; row < members.size(); ++row) {
    double pivot = a[members[row]][members[row]];
    for (std::size_t column = 0; column < row; ++column) {
      double sum = a[members[row]][members[column]];
      for (std::size_t k = 0; k < column; ++k) sum -= scaled[k] * lower_[column][k];
      scaled[column] = sum;
      lower_[row][column] = sum * inverse_d_[column];
      pivot -= sum * lower_[row][column];
    }
    const double diagonal = a[members[row]][members[row]];
    inverse_d_[row] = pivot > kDependent * diagonal ? 1.0 / pivot : 0.0;
  }
}

void Factor::solve(const Vector& b, Vector& x) const {
  const std::size_t size = members_.size();
  Vector y;
  for (std::size_t row = 0; row < size; ++row) {
    y[row] = b[members_[row]];
    for (std::size_t k = 0; k < row; ++k) y[row] -= lower_[row][k] * y[k];
  }
  for (std::size_t row = size; row-- > 0;) {
    y[row] *= inverse_d_[row];
    for (std::size_t k = row + 1; k < size; ++k) y[row] -= lower_[k][row] * y[k];
    x[members_[row]] = y[row];
  }
}

Complementarity solve_complementarity(const Matrix& a, const Vector& b, const Members& candidates) {
  // Numbers below these are rounding of 0.
  constexpr double kRounding = 1e-14;
  double largest_b = 0.0;
  for (const std::size_t i : candidates) largest_b = std::max(largest_b, std::abs(b[i]));

  Complementarity solution;
  Vector minus_b;
  for (const std::size_t i : candidates) minus_b[i] = -b[i];
  Factor factor;
  for (int pivots = 0; pivots <= 1 << kMaxCables; ++pivots) {
    solution.pull.fill(0.0);
    factor.compute(a, solution.active);
    factor.solve(minus_b, solution.pull);
    double largest_pull = 0.0;
    for (const std::size_t i : solution.active)
      largest_pull = std::max(largest_pull, std::abs(solution.pull[i]));

    const auto* wrong = std::find_if(candidates.begin(), candidates.end(), [&](std::size_t i) {
      if (solution.active.has(i)) return solution.pull[i] < -kRounding * largest_pull;
      double w = b[i], terms = largest_b;
      for (const std::size_t k : solution.active) {
        w += a[i][k] * solution.pull[k];
        terms = std::max(terms, std::abs(a[i][k] * solution.pull[k]));
      }
      return w < -kRounding * terms;
    });
    if (wrong == candidates.end()) {
      for (const std::size_t i : solution.active)
        solution.pull[i] = std::max(solution.pull[i], 0.0);
      return solution;
    }
    if (solution.active.has(*wrong))
      solution.active.remove(*wrong);
    else
      solution.active.add(*wrong);
  }
  throw std::runtime_error("cables: the tensions have no solution: the masses are out of range");
}

}  // namespace sls::sim::cables
