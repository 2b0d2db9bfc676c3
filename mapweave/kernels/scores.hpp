// What samples find at many transforms, in single precision. The twin and the words are in scores.py.
#pragma once
#include <algorithm>
#include <vector>

#include "arrays.hpp"

namespace scores {

constexpr double kTurns = 4;  // added to directions, so that turned ones are above 0

// A sample as it is looked up: its place [cells], its direction, and what a metre of it counts, found or missed [m].
struct Sample {
  float x, y, direction;
  double found, missed;
};

// Every `stride`th sample, which stands for those between.
inline std::vector<Sample> samples_of(In<double, 2> points, In<double, 1> facing, In<double, 1> weight,
                                      In<double, 1> missing, size_t stride, double cell, double directions) {
  const size_t n = weight.shape(0);
  double all = 0, few = 0;
  for (size_t k = 0; k < n; ++k) all += weight(k);
  for (size_t k = 0; k < n; k += stride) few += weight(k);
  std::vector<Sample> samples;
  samples.reserve(n / stride + 1);
  for (size_t k = 0; k < n; k += stride) {
    const double metres = weight(k) * (all / std::max(few, 1e-300));
    samples.push_back({static_cast<float>(points(k, 0) / cell), static_cast<float>(points(k, 1) / cell),
                       static_cast<float>((facing(k) + kTurns) * directions), metres, metres * missing(k)});
  }
  return samples;
}

inline Out<double> look_up_scores(In<double, 2> points, In<double, 1> facing, In<double, 1> weight,
                                  In<double, 1> missing, size_t stride, In<float, 2> motions, double cell,
                                  In<uint8_t, 2> codes, In<float, 2> worth) {
  const size_t n = points.shape(0), k = motions.shape(0);
  const int64_t rows = static_cast<int64_t>(codes.shape(0)), columns = static_cast<int64_t>(codes.shape(1));
  const int64_t directions = static_cast<int64_t>(worth.shape(1));
  if (points.shape(1) != 2 || facing.shape(0) != n || weight.shape(0) != n || missing.shape(0) != n)
    throw std::invalid_argument("points (n, 2), facing, weight and missing (n,) expected");
  if (motions.shape(1) != 5 || rows < 1 || columns < 1 || stride < 1 || !(cell > 0))
    throw std::invalid_argument("motions (k, 5), codes of a cell or more, stride and cell above 0 expected");
  if (directions < 1 || (directions & (directions - 1)))
    throw std::invalid_argument("directions: a power of two expected");
  uint8_t most = 0;
  for (size_t at = 0; at < codes.size(); ++at) most = std::max(most, codes.data()[at]);
  if (most >= worth.shape(0)) throw std::invalid_argument("codes: rows of worth expected");
  const float last_row = static_cast<float>(rows - 1), last_column = static_cast<float>(columns - 1);
  const int32_t mask = static_cast<int32_t>(directions - 1);
  const auto samples = samples_of(points, facing, weight, missing, stride, cell, static_cast<double>(directions));
  std::vector<double> sums(k, 0.0);
  for (size_t t = 0; t < k; ++t) {
    const float* m = motions.data() + 5 * t;
    const float c = m[0], s = m[1], x0 = m[2], y0 = m[3], turn = m[4];
    double sum = 0;
    for (const Sample& p : samples) {
      const float x = c * p.x - s * p.y + x0, y = s * p.x + c * p.y + y0;
      const int64_t row = static_cast<int64_t>(x > 0 ? std::min(x, last_row) : 0.0f);
      const int64_t column = static_cast<int64_t>(y > 0 ? std::min(y, last_column) : 0.0f);
      const int32_t direction = static_cast<int32_t>(p.direction + turn) & mask;
      const double counts = worth.data()[codes.data()[row * columns + column] * directions + direction];
      sum += counts * (counts < 0 ? p.missed : p.found);
    }
    sums[t] = sum;
  }
  return give(std::move(sums), {k});
}

}  // namespace scores

inline void bind_scores(nb::module_& m) {
  m.def("look_up_scores", &scores::look_up_scores, nb::arg("points"), nb::arg("facing"), nb::arg("weight"),
        nb::arg("missing"), nb::arg("stride"), nb::arg("motions"), nb::arg("cell"), nb::arg("codes"),
        nb::arg("worth"));
}
