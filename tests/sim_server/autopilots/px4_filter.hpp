/// The impulse response of a sampled Butterworth filter, from its poles.
#pragma once

#include <cmath>
#include <complex>
#include <vector>

namespace sls::sim::test {

/// First `count` outputs for the input 1, 0, 0, …: the bilinear transform of the analogue poles,
/// then partial fractions. Uses no difference equation.
inline std::vector<double> calc_impulse_response(double sample_rate, double cut_off,
                                                 std::size_t count) {
  using Complex = std::complex<double>;
  const double pi = std::acos(-1.0);
  const double warped = 2.0 * sample_rate * std::tan(pi * cut_off / sample_rate);
  const Complex s = std::polar(warped, 0.75 * pi);
  const Complex p = (1.0 + s / (2.0 * sample_rate)) / (1.0 - s / (2.0 * sample_rate));
  // H(z) = K (z + 1)² / ((z − p)(z − p*)), and H(1) = 1.
  const double gain = std::norm(1.0 - p) / 4.0;
  const Complex residue =
      gain * ((2.0 + 2.0 * p.real()) * p + 1.0 - std::norm(p)) / (p - std::conj(p));
  std::vector<double> response{gain};
  Complex power = 1.0;
  for (std::size_t n = 1; n < count; ++n, power *= p)
    response.push_back(2.0 * (residue * power).real());
  return response;
}

}  // namespace sls::sim::test
