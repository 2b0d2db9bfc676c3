// Correlative search: the score of every pose in a window. The twin and the words are in correlative.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "arrays.hpp"

namespace correlative {

constexpr int64_t kMany = 1000;  // points at all turns, from which laying out the field anew is worth it

// (size + 1, size + 1) nearness in [0, 1]; the last row and column stand for everything outside: 0.
inline Out<float> nearness_field(In<double, 2> points, In<double, 1> origin, double cell, int64_t size,
                                 double sigma) {
  if (points.shape(1) != 2 || origin.shape(0) != 2 || size < 1 || !(cell > 0 && sigma > 0))
    throw std::invalid_argument("points (n, 2), origin (2,), size >= 1, cell and sigma > 0 expected");
  const int64_t side = size + 1;
  const int64_t reach = static_cast<int64_t>(std::floor(4 * sigma / cell));
  std::vector<float> kernel(static_cast<size_t>((reach + 1) * (reach + 1)));
  for (int64_t a = 0; a <= reach; ++a)
    for (int64_t b = 0; b <= reach; ++b) {
      const double squared = static_cast<double>(a * a + b * b) * cell * cell;
      kernel[a * (reach + 1) + b] = squared <= 16 * sigma * sigma ? static_cast<float>(std::exp(-squared / (2 * sigma * sigma))) : 0.0f;
    }
  std::vector<char> taken(static_cast<size_t>(side * side), 0);
  std::vector<float> value(static_cast<size_t>(side * side), 0.0f);
  for (size_t k = 0; k < points.shape(0); ++k) {
    const double* p = points.data() + 2 * k;
    const double column = std::floor((p[0] - origin.data()[0]) / cell), row = std::floor((p[1] - origin.data()[1]) / cell);
    if (!(column >= 0 && column < size && row >= 0 && row < size)) continue;
    const int64_t i = static_cast<int64_t>(column), j = static_cast<int64_t>(row);
    char& here = taken[i * side + j];
    if (here) continue;
    here = 1;
    for (int64_t a = std::max<int64_t>(0, i - reach); a <= std::min(size - 1, i + reach); ++a)
      for (int64_t b = std::max<int64_t>(0, j - reach); b <= std::min(size - 1, j + reach); ++b) {
        float& there = value[a * side + b];
        there = std::max(there, kernel[std::abs(a - i) * (reach + 1) + std::abs(b - j)]);
      }
  }
  return give(std::move(value), {static_cast<size_t>(side), static_cast<size_t>(side)});
}

// The cells between shifts along a line, if they are the same between all of them; else 0.
inline int64_t stride_of(const std::vector<int64_t>& base) {
  if (base.size() < 4 || base[3] <= base[1]) return 0;
  for (size_t k = 3; k < base.size(); k += 2)
    if (base[k] - base[k - 2] != base[3] - base[1]) return 0;
  return base[3] - base[1];
}

// The field's lines with every `stride`-th cell side by side: what a row of shifts looks up. Before and after each line
// go on as many cells as a row has, that say what its last one says: so no row of shifts ends outside.
class Strided {
 public:
  Strided(const float* field, int64_t side, int64_t stride, int64_t count)
      : stride_(stride), before_(count * stride), last_(side), run_((side + stride - 1) / stride + 2 * count + 1),
        cells_(static_cast<size_t>(side * stride * run_)) {
    for (int64_t i = 0; i < side; ++i)
      for (int64_t phase = 0; phase < stride; ++phase) {
        float* to = cells_.data() + (i * stride + phase) * run_;
        std::fill(to, to + run_, field[i * side + side - 1]);
        to += count;
        for (int64_t j = phase; j < side; j += stride) *to++ = field[i * side + j];
      }
  }

  // How far from a line's beginning on the row of shifts is that begins at cell `j`, wherever that is.
  int64_t offset(int64_t j) const {
    const int64_t from = std::clamp(j, -before_, last_) + before_;
    return from % stride_ * run_ + from / stride_;
  }
  const float* line(int64_t i) const { return cells_.data() + i * stride_ * run_; }

 private:
  int64_t stride_, before_, last_, run_;
  std::vector<float> cells_;
};

constexpr int kTogether = 4;  // points whose rows are added in one go

// Adds four rows to the sums, one after the other: what comes of it is what adding each by itself gives.
MAPWEAVE_WIDE inline void add_rows(float* __restrict sums, const float* const rows[kTogether], int64_t count) {
  const float *r0 = rows[0], *r1 = rows[1], *r2 = rows[2], *r3 = rows[3];
  for (int64_t b = 0; b < count; ++b) sums[b] = (((sums[b] + r0[b]) + r1[b]) + r2[b]) + r3[b];
}

// A turned point's cell, and where its row of shifts begins in a line.
struct Voter {
  int64_t column, row, offset;
};

// (t, s, s) summed nearness of the points, turned by each of t turns and moved by each pair of s shifts.
inline Out<float> window_scores(In<double, 2> points, In<float, 2> field, In<double, 1> origin, double cell,
                                In<double, 1> turns, In<double, 2> shifts) {
  const int64_t n = static_cast<int64_t>(points.shape(0)), outside = static_cast<int64_t>(field.shape(0)) - 1;
  const int64_t s = static_cast<int64_t>(shifts.shape(0)), t = static_cast<int64_t>(turns.shape(0));
  if (points.shape(1) != 2 || shifts.shape(1) != 2 || field.shape(0) != field.shape(1) || outside < 0 || origin.shape(0) != 2)
    throw std::invalid_argument("points (n, 2), field (m, m), origin (2,), shifts (s, 2) expected");
  std::vector<int64_t> base(static_cast<size_t>(2 * s));
  for (int64_t k = 0; k < s; ++k)
    for (int64_t a = 0; a < 2; ++a)
      base[2 * k + a] = static_cast<int64_t>(std::nearbyint((shifts.data()[2 * k + a] - origin.data()[a]) / cell));
  std::vector<float> scores(static_cast<size_t>(t * s * s), 0.0f);
  const int64_t stride = t * n >= kMany ? stride_of(base) : 0;
  const Strided strided(field.data(), stride ? outside + 1 : 0, stride ? stride : 1, stride ? s : 0);
  const auto inside = [&](int64_t at) { return at < 0 || at > outside ? outside : at; };
  std::vector<Voter> voters(static_cast<size_t>(n));
  for (int64_t k = 0; k < t; ++k) {
    const double c = std::cos(turns.data()[k]), sn = std::sin(turns.data()[k]);
    for (int64_t i = 0; i < n; ++i) {
      const double* p = points.data() + 2 * i;
      Voter& voter = voters[i];
      voter.column = floor_of((c * p[0] - sn * p[1]) / cell);
      voter.row = floor_of((sn * p[0] + c * p[1]) / cell);
      voter.offset = stride ? strided.offset(voter.row + base[1]) : 0;
    }
    for (int64_t a = 0; a < s; ++a) {
      float* sums = scores.data() + (k * s + a) * s;
      int64_t i = 0;
      for (; stride && i + kTogether <= n; i += kTogether) {
        const float* rows[kTogether];
        for (int e = 0; e < kTogether; ++e)
          rows[e] = strided.line(inside(voters[i + e].column + base[2 * a])) + voters[i + e].offset;
        add_rows(sums, rows, s);
      }
      for (; i < n; ++i) {
        const float* line = field.data() + inside(voters[i].column + base[2 * a]) * (outside + 1);
        for (int64_t b = 0; b < s; ++b) sums[b] += line[inside(voters[i].row + base[2 * b + 1])];
      }
    }
  }
  return give(std::move(scores), {static_cast<size_t>(t), static_cast<size_t>(s), static_cast<size_t>(s)});
}

}  // namespace correlative

inline void bind_correlative(nb::module_& m) {
  m.def("nearness_field", &correlative::nearness_field, nb::arg("points"), nb::arg("origin"), nb::arg("cell"),
        nb::arg("size"), nb::arg("sigma"));
  m.def("window_scores", &correlative::window_scores, nb::arg("points"), nb::arg("field"), nb::arg("origin"),
        nb::arg("cell"), nb::arg("turns"), nb::arg("shifts"));
}
