#!/usr/bin/env python3
"""Writes math_constants.hpp: the polynomials and tables of math.cpp, computed with 400 bits (Debian: python3-mpmath).

Polynomials have the least greatest error (Remez's exchange) before their coefficients are rounded to double; the
greatest relative error of each stands beside it. A constant in parts is the sum of them.
usage: math_constants.py > math_constants.hpp   # then format it
"""
import mpmath as mp

mp.mp.prec = 400


def remez(target, weight, low, high, count):
    """Coefficients c of Σ c_i z^i, and log2 of max |weight(z) (Σ c_i z^i − target(z))| over [low, high]."""
    low, high = mp.mpf(low), mp.mpf(high)
    middle, half = (low + high) / 2, (high - low) / 2
    nodes = [middle - half * mp.cos(mp.pi * i / count) for i in range(count + 1)]
    grid = [middle - half * mp.cos(mp.pi * i / 2000) for i in range(2001)]
    values = [(z, target(z), weight(z)) for z in grid]
    for _ in range(12):
        rows = [[z**i for i in range(count)] + [(-1)**k / weight(z)] for k, z in enumerate(nodes)]
        solution = mp.lu_solve(mp.matrix(rows), mp.matrix([target(z) for z in nodes]))
        coefficients = list(solution[:count])
        errors = [(z, w * (mp.polyval(coefficients[::-1], z) - f)) for z, f, w in values]
        peaks = []  # the greatest error of each run of one sign
        for z, error in errors:
            if peaks and mp.sign(peaks[-1][1]) == mp.sign(error):
                if abs(error) > abs(peaks[-1][1]):
                    peaks[-1] = (z, error)
            else:
                peaks.append((z, error))
        while len(peaks) > count + 1:
            peaks.pop(0 if abs(peaks[0][1]) < abs(peaks[-1][1]) else -1)
        if len(peaks) < count + 1:
            break
        exchanged = [z for z, _ in peaks]
        if exchanged == nodes:  # the same solution again
            break
        nodes = exchanged
    rounded = [float(c) for c in coefficients]
    worst = max(abs(w * (mp.polyval([mp.mpf(c) for c in rounded][::-1], z) - f)) for z, f, w in values)
    return rounded, mp.log(worst, 2)


def split(number, *bits):
    """Parts of `number`: one of each count of leading bits in `bits`, then a double of the rest."""
    parts = []
    for count in bits:
        scale = mp.mpf(2)**(count - 1 - mp.floor(mp.log(abs(number), 2)))
        parts.append(mp.floor(number * scale) / scale)
        number -= parts[-1]
    return [float(part) for part in parts] + [float(number)]


def write_polynomial(name, comment, fitted):
    coefficients, error = fitted
    print(f"/// {comment}; error 2^{float(error):.1f}.")
    print(f"constexpr double {name}[] = {{{', '.join(c.hex() for c in coefficients)}}};\n")


def write_number(name, number):
    print(f"constexpr double {name} = {float(number).hex()};")


def write_table(comment, struct, fields, name, rows):
    print(f"\n/// {comment}")
    print(f"struct {struct} {{ double {', '.join(fields)}; }};")
    print(f"constexpr {struct} {name}[] = {{")
    for row in rows:
        print(f"{{{', '.join(float(value).hex() for value in row)}}},")
    print("};")


def ratio(function, limit):
    """`function` of z, or `limit` where the quotient it holds is 0/0."""
    return lambda z: function(z) if z > mp.mpf(2)**-60 else limit


print("// Written by math_constants.py: change that file.")
print("#pragma once\n\n#include <cstdint>\n\nnamespace sls::math::constants {\n")

print("// sin and cos")
top = (mp.pi / 4 * (1 + mp.mpf(2)**-20))**2
write_polynomial("kSine", "(sin r / r − 1) / z of z = r², |r| <= π/4", remez(
    ratio(lambda z: (mp.sin(mp.sqrt(z)) / mp.sqrt(z) - 1) / z, -mp.mpf(1) / 6), lambda z: z + mp.mpf(2)**-40, 0, top, 6))
write_polynomial("kCosine", "(cos r − 1 + z/2) / z² of z = r², |r| <= π/4", remez(
    ratio(lambda z: (mp.cos(mp.sqrt(z)) - 1 + z / 2) / z**2, mp.mpf(1) / 24), lambda z: z**2 + mp.mpf(2)**-40, 0, top, 6))
write_number("kTwoOverPi", 2 / mp.pi)
for part, value in zip(("High", "Middle", "Low"), split(mp.pi / 2, 33, 33)):
    write_number("kHalfPi" + part, value)
with mp.workprec(1500):
    digits = int(mp.floor(2 / mp.pi * mp.mpf(2)**1216))
words = [0, 0] + [(digits >> (1216 - 32 * (i + 1))) & 0xFFFFFFFF for i in range(38)]
print("\n/// 64 zeros, then the first 1216 bits of 2/π.")
print(f"constexpr std::uint32_t kTwoOverPiBits[] = {{{', '.join(hex(word) for word in words)}}};\n")

print("// exp")
SIZE = 32
quotient = mp.log(2) / SIZE
edge = quotient / 2 * (1 + mp.mpf(2)**-20)
write_polynomial("kExponential", "(e^r − 1 − r) / r², |r| <= ln 2 / 64", remez(
    lambda r: (mp.exp(r) - 1 - r) / r**2 if abs(r) > mp.mpf(2)**-60 else mp.mpf(1) / 2,
    lambda r: r**2 + mp.mpf(2)**-40, -edge, edge, 5))
write_number("kExponentialSteps", 1 / quotient)
for part, value in zip(("High", "Low"), split(quotient, 36)):
    write_number("kExponentialStep" + part, value)
write_table("2^(i/32) in two parts.", "Power", ("high", "low"), "kPowers",
            [(high := mp.mpf(float(mp.mpf(2)**(mp.mpf(i) / SIZE))), mp.mpf(2)**(mp.mpf(i) / SIZE) - high)
             for i in range(SIZE)])

print("\n// log")
# A mantissa m lies in [first, 2 first); interval i holds the doubles whose bits begin alike, so that the intervals
# below 1 have half the width of those above. That around 1 has 1 as its centre.
INTERVALS = 128
first = 1 - mp.mpf(2)**-8 * (40 + mp.mpf(2) / 3)
first = mp.floor(first * 2**20) / 2**20
bounds = [first + i * mp.mpf(2)**-8 for i in range(INTERVALS + 1)]
bounds = [b if b <= 1 else 1 + 2 * (b - 1) for b in bounds]
rows = []
reach = mp.mpf(0)
for low, high in zip(bounds, bounds[1:]):
    inverse = mp.mpf(1) if low < 1 < high else mp.nint(2 / (low + high) * 2**10) / 2**10  # at most 11 bits
    reach = max(reach, abs(low * inverse - 1), abs(high * inverse - 1))
    value = -mp.log(inverse)
    high_part = mp.nint(value * 2**42) / 2**42
    rows.append((inverse, high_part, value - high_part))
write_polynomial("kLogarithm", "(log(1 + r) − r) / r², |r| <= 2^" + f"{float(mp.log(reach, 2)):.2f}", remez(
    lambda r: (mp.log(1 + r) - r) / r**2 if abs(r) > mp.mpf(2)**-60 else -mp.mpf(1) / 2,
    lambda r: abs(r) + mp.mpf(2)**-40, -reach, reach, 6))
print(f"constexpr std::uint64_t kLogarithmFirst = {hex(int(mp.floor((first * 2 - 1) * mp.mpf(2)**52)) | 1022 << 52)};")
whole = mp.nint(mp.log(2) * 2**42) / 2**42
write_number("kLogTwoHigh", whole)
write_number("kLogTwoLow", mp.log(2) - whole)
write_table("1/c, and log(c) in two parts, of a c in each interval.", "Interval",
            ("inverse", "log_high", "log_low"), "kIntervals", rows)

print("\n// atan2")
write_polynomial("kArcTangent", "(atan t / t − 1) / z of z = t², |t| <= 1/64", remez(
    ratio(lambda z: (mp.atan(mp.sqrt(z)) / mp.sqrt(z) - 1) / z, -mp.mpf(1) / 3), lambda z: z + mp.mpf(2)**-40,
    0, (mp.mpf(1) / 64 * (1 + mp.mpf(2)**-20))**2, 4))
for part, value in zip(("High", "Low"), split(mp.pi, 53)):
    write_number("kPi" + part, value)
write_table("atan(i/32) in two parts.", "Angle", ("high", "low"), "kAngles",
            [(high := mp.mpf(float(mp.atan(mp.mpf(i) / 32))), mp.atan(mp.mpf(i) / 32) - high) for i in range(33)])
print("""
/// The axis that an octant's angles are measured from, in two parts, and their sense.
struct Axis { double high, low, sign; };
/// By "|y| > |x|" and "x is negative".""")
low = mp.pi - mp.mpf(float(mp.pi))
print("constexpr Axis kAxes[2][2] = {")
for row in (((0, 0, 1), (mp.pi, low, -1)), ((mp.pi / 2, low / 2, -1), (mp.pi / 2, low / 2, 1))):
    print("{" + ", ".join(f"{{{float(a).hex()}, {float(b).hex()}, {c}.0}}" for a, b, c in row) + "},")
print("};")
print("\n}  // namespace sls::math::constants")
