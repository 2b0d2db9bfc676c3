// What samples find at many transforms, in single precision. The twin and the words are in scores.py.
#pragma once
#include <algorithm>
#include <vector>

#include "arrays.hpp"

namespace scores {

inline Out<double> look_up_scores(In<float, 2> samples, In<double, 1> weight, In<float, 2> motions, In<uint8_t, 2> codes,
                                  In<float, 1> worth, int64_t directions) {
  const size_t n = samples.shape(0), k = motions.shape(0);
  const int64_t rows = static_cast<int64_t>(codes.shape(0)), columns = static_cast<int64_t>(codes.shape(1));
  if (samples.shape(1) != 3 || weight.shape(0) != n || motions.shape(1) != 5 || rows < 1 || columns < 1)
    throw std::invalid_argument("samples (n, 3), weight (n,), motions (k, 5), codes of a cell or more expected");
  if (directions < 1 || (directions & (directions - 1)))
    throw std::invalid_argument("directions: a power of two expected");
  const uint8_t most = *std::max_element(codes.data(), codes.data() + rows * columns);
  if ((most + 1) * directions > static_cast<int64_t>(worth.shape(0)))
    throw std::invalid_argument("codes: rows of worth expected");
  const float last_row = static_cast<float>(rows - 1), last_column = static_cast<float>(columns - 1);
  const int32_t mask = static_cast<int32_t>(directions - 1);
  std::vector<double> sums(k, 0.0);
  for (size_t t = 0; t < k; ++t) {
    const float* m = motions.data() + 5 * t;
    const float c = m[0], s = m[1], x0 = m[2], y0 = m[3], turn = m[4];
    double sum = 0;
    for (size_t i = 0; i < n; ++i) {
      const float *p = samples.data() + 3 * i;
      const float x = c * p[0] - s * p[1] + x0, y = s * p[0] + c * p[1] + y0;
      const int64_t row = static_cast<int64_t>(x > 0 ? std::min(x, last_row) : 0.0f);
      const int64_t column = static_cast<int64_t>(y > 0 ? std::min(y, last_column) : 0.0f);
      const int32_t direction = static_cast<int32_t>(p[2] + turn) & mask;
      sum += static_cast<double>(worth.data()[codes.data()[row * columns + column] * directions + direction]) * weight.data()[i];
    }
    sums[t] = sum;
  }
  return give(std::move(sums), {k});
}

}  // namespace scores

inline void bind_scores(nb::module_& m) {
  m.def("look_up_scores", &scores::look_up_scores, nb::arg("samples"), nb::arg("weight"), nb::arg("motions"),
        nb::arg("codes"), nb::arg("worth"), nb::arg("directions"));
}
